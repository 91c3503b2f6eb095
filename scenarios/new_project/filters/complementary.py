"""Inertial navigation that each fix draws a fifth of the way to itself: a complementary filter."""

from dataclasses import replace

import sinssim


class Filter:
    """It gets increments and readings in the order of their arrival; `sigma`, nine 1σ, may be stated as well."""

    def __init__(self, start):
        self.state = start

    def predict(self, increments):
        self.state = sinssim.navigate(increments, self.state).state()

    def update(self, reading):
        s, z = self.state, reading.value
        if reading.kind == "gnss-position":
            north, east, up = 0.2 * (z - (s.latitude, s.longitude, s.height))  # rad, rad, m
            self.state = replace(s, latitude=s.latitude + north, longitude=s.longitude + east, height=s.height + up)
        elif reading.kind == "gnss-velocity":
            self.state = replace(s, velocity_ned=s.velocity_ned + 0.5 * (z - s.velocity_ned))

    def solution(self):
        return self.state
