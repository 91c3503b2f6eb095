"""Sets of sensors other than three gyros and three accelerometers: redundant, gyro-free, gimballed, single."""
