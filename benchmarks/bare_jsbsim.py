"""JSBSim alone, as a whole process: loads a model, trims it in the air and steps it; no sinssim.

    python benchmarks/bare_jsbsim.py MODEL SECONDS STEP ALTITUDE_FT AIRSPEED_KT [FOLDER]

FOLDER holds the model as sinssim loads it, without the sockets that some shipped models open; without it the model is
the one that the jsbsim package ships. `bench_demo` compares its run with this.
"""

import sys
import tempfile
from pathlib import Path

import jsbsim

model, seconds, step, altitude, airspeed = sys.argv[1], *map(float, sys.argv[2:6])
executive = jsbsim.FGFDMExec(None)
executive.set_debug_level(0)
executive.set_output_path(tempfile.gettempdir())
if len(sys.argv) > 6:
    root = Path(jsbsim.get_default_root_dir())
    executive.load_model_with_paths(model, sys.argv[6], str(root / "engine"), str(root / "systems"))
else:
    executive.load_model(model)
executive.disable_output()
executive.set_dt(step)
executive["ic/h-sl-ft"] = altitude
executive["ic/vc-kts"] = airspeed
executive.run_ic()
executive["propulsion/set-running"] = -1
executive["simulation/do_simple_trim"] = 1
for _ in range(round(seconds / step)):
    executive.run()
