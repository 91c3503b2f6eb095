"""The registry of the formats of recorded files.

Adding a format takes a file beside this one and a line in `FORMATS`. The file defines

    def recognises(path: Path, head: bytes) -> bool: whether a file with these first 4096 bytes may be of the format
    def read(path: Path) -> Streams: its streams; InputError with file and row if it cannot be read

A format may be a folder; then the head is empty, and the file also defines

    def files_of(folder: Path) -> list[Path]: the files in a folder that belong to the format
"""

from __future__ import annotations

from sinssim.system.own_content.registry import modules

FORMATS = modules("formats", "format", {
    "kf-gins-imu": ("navigators.kf_gins_imu", "IMU file of KF-GINS: seconds of week, Δθ, Δv, forward-right-down"),
    "kf-gins-gnss": ("navigators.kf_gins_gnss", "GNSS file of KF-GINS: seconds of week, position, σ; or with velocity"),
    "kf-gins-solution": ("navigators.kf_gins_solution", "solution or truth of KF-GINS: position, velocity, attitude"),
    "psins-imu": ("navigators.psins_imu", "PSINS .imu: counts of angle and velocity, scale factors, right-front-up"),
    "psins-avp": ("navigators.psins_avp", "PSINS .avp: attitude, velocity, position, time"),
    "sbet": ("navigators.sbet", "Applanix SBET: 17 doubles per record"),
    "gnss-ins-sim": ("navigators.gnss_ins_sim", "folder of gnss-ins-sim: time.csv, gyro-0.csv, accel-0.csv, gps-0.csv"),
    "inertial-explorer": ("navigators.inertial_explorer", "text export of Inertial Explorer or GrafNav"),
    "nmea": ("receivers.nmea", "NMEA 0183 (library pynmeagps)"),
    "ubx": ("receivers.ubx", "u-blox UBX: NAV-PVT, NAV-HPPOSLLH, NAV-COV, NAV-RELPOSNED (library pyubx2)"),
    "novatel": ("receivers.novatel", "NovAtel, Unicore: RAWIMU, BESTPOS, BESTVEL, INSPVA (binary by novatel-edie)"),
    "chc": ("receivers.chc", "CHC CGI receivers: GPCHC sentences with IMU data and solution"),
    "vbox": ("receivers.vbox", "Racelogic VBOX (.vbo): fixes"),
    "flysight": ("receivers.flysight", "FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers"),
    "android-gnss": ("receivers.android_gnss", "GnssLogger of Android: gyros, accelerometers, fixes"),
    "ardupilot": ("robots.ardupilot", "ArduPilot: DataFlash .bin and .log, text of mavlogdump: IMU, GPS"),
    "ulog": ("robots.ulog", "PX4 ULog (library pyulog)"),
    "ros": ("robots.ros", "ROS 1 and 2 bags, MCAP: Imu, NavSatFix, TwistStamped, Odometry (library rosbags)"),
    "euroc": ("robots.euroc", "EuRoC: CSV files of IMU and ground truth"),
    "tum": ("robots.tum", "TUM trajectory: time, position, quaternion"),
    "kitti-oxts": ("robots.kitti_oxts", "KITTI OXTS: folder of text files, 30 numbers each"),
    "columns": ("columns", "CSV whose columns are named with their units: time_s, latitude_deg, height_m, …"),
    "gpx": ("gpx", "GPX 1.0 and 1.1: track points with UTC times"),
    "kml": ("kml", "KML: gx:Track with times"),
    "track-csv": ("track_csv", "CSV or Parquet with named columns: time_s, latitude_deg, longitude_deg, height_m, …"),
    "rtklib-pos": ("rtklib_pos", "solution of RTKLIB (.pos): dates or GPS weeks; positions geodetic or x, y, z"),
})  # fmt: skip
"""Module under `sinssim.logs.formats` and a sentence on the format, by its name; then formats outside the package."""
