"""The registry of the formats that a run is written in.

Adding a format takes a file beside this one and a line in `WRITERS`. The file defines

    SUFFIX: suffix of its file, "" if it is a folder
    HOLDS: what goes into it: "solution" for one solution, "run" for the truth or a solution, readings and fixes
    def write(content: Content, place: Path) -> list[str]: writes it, and says in sentences what is where
"""

from __future__ import annotations

from sinssim.system.own_content.registry import modules

DEFAULT_START = "2026-01-01T00:00:00Z"
"""Date of the time 0 of a run if none is given."""

WRITERS = modules("writers", "format", {
    "csv": ("csv_tables", "folder of CSV files, one for each stream, units in the names of the columns"),
    "parquet": ("parquet", "folder of Parquet files, every stream of the run and the errors of its solutions"),
    "mat": ("matlab", "MATLAB .mat with all streams as structures"),
    "kml": ("maps.kml", "path with heights and time for Google Earth"),
    "gpx": ("maps.gpx", "GPX 1.1 track"),
    "geojson": ("maps.geojson", "GeoJSON line with times"),
    "kf-gins": ("navigators.kf_gins", "KF-GINS: folder of IMU, GNSS, truth and configuration"),
    "psins": ("navigators.psins", "PSINS: folder of .imu, .avp of the truth and of the fixes"),
    "gnss-ins-sim": ("navigators.gnss_ins_sim", "folder of CSV files as gnss-ins-sim saves them"),
    "sbet": ("navigators.sbet", "Applanix SBET, 17 doubles per record"),
    "rtklib-pos": ("navigators.rtklib_pos", "RTKLIB solution, .pos"),
    "nmea": ("navigators.nmea", "NMEA 0183: GGA, RMC, and HDT with an attitude"),
    "mcap": ("robots.mcap", "MCAP with ROS 2 messages: Imu, NavSatFix, TwistStamped, Odometry"),
    "euroc": ("robots.euroc", "EuRoC: folder mav0 with IMU and ground truth"),
    "tum": ("robots.tum", "TUM trajectory: time, position, quaternion"),
})  # fmt: skip
"""Module under `sinssim.logs.writers` and a sentence on the format, by its name; then formats outside the package."""
