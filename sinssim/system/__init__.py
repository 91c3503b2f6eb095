"""Files, processes, memory, project folders and their registries."""
