"""The true motion along a track."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.logs.track_source import TrackSource
from sinssim.truth.motion import NORMAL_EARTH, Mounting, TrueEarth
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.logs.track_preparation import PreparedTrack


class Track(TrackSource):
    """Recorded or planned motion: a file of positions with times, with or without attitude, or waypoints. The program
    computes a smooth curve, along which the ideal sensors are exact; see tracks.md.
    """

    def prepared(self, earth: TrueEarth) -> PreparedTrack:
        """Return the curve of the track; the last ones are kept.

        Raises:
            InputError: file or route cannot be used; the message names file and row, or the waypoint.
        """
        from sinssim.logs.track_preparation import prepare  # needs the compiler

        return prepare(self, earth, self.digest())

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return the duration of the curve; see `Motion.duration`."""
        return self.prepared(earth).duration

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return ∫ω² dt of the curve; see `Motion.turning`."""
        return self.prepared(earth).fit.turning

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        """Return the motion of the block; see `Motion.block_motion`."""
        from sinssim.truth.track.track_curve import track_curve  # needs the compiler

        track = self.prepared(earth)
        return track_curve(
            track.knots,
            track.fit,
            block.lever_arm_m,
            block.q_bs,
            earth.gravity,
            earth.figure,
            track.events,
            track.channels,
        )
