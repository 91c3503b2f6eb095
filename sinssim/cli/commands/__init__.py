"""The commands: functions with the decorator `command`, in files by what they work on."""
