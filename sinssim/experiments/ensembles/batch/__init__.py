"""Sensor errors and pure inertial navigation of many runs at once, with nothing stored but the epochs.

A lane is a group of `layout.LANES` runs whose numbers are neighbours in memory. The kernel in `lanes` calls the scalar
functions of the single run (`sinssim.sensors.imu.error_kernel.channel_k`, `sinssim.strapdown.frames.level.step_level_k`
and the parts of the attitude algorithm) for every run of a lane, so that the compiler uses the processor's vector units
across runs. `navigate_batch` is the interface; `served` says which options it serves.
"""
