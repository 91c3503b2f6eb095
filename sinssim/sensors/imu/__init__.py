"""The sensor block: keys of `[imu]`, the table of error terms, grades and datasheets, emulator, compensation."""
