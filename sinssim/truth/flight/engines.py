"""Starts and stops the engines of a JSBSim model as a pilot does: starter, magnetos or fuel."""

from __future__ import annotations

from typing import Any

_LIGHT_UP = 15.0  # speed of a turbine's high-pressure shaft at which the fuel is opened [% of N2]


class Engines:
    """The engines of a model.

    A piston engine runs after magnetos and starter are on; a turbine after its starter has brought it to `_LIGHT_UP`
    and the fuel is open. The models of JSBSim then compute the start themselves.
    """

    def __init__(self, executive: Any) -> None:
        """Find the engines."""
        self._executive = executive
        manager = executive.get_property_manager()
        self._numbers = range(executive.get_propulsion().get_num_engines())
        self._running = [manager.get_node(f"propulsion/engine[{i}]/set-running") for i in self._numbers]
        self._shafts = [
            manager.get_node(f"propulsion/engine[{i}]/n2")
            for i in self._numbers
            if manager.hasNode(f"propulsion/engine[{i}]/n2")
        ]
        self._has_mixture = manager.hasNode("fcs/mixture-cmd-norm")
        self._mixture = executive["fcs/mixture-cmd-norm"] if self._has_mixture else 0.0

    @property
    def running(self) -> bool:
        """Whether every engine runs, and there is one."""
        return bool(self._running) and all(node.get_double_value() > 0.5 for node in self._running)

    @property
    def stopped(self) -> bool:
        """Whether no engine runs."""
        return all(node.get_double_value() < 0.5 for node in self._running)

    def switch(self, wanted: bool) -> None:
        """Move the switches towards a state of the engines; called again until it is reached."""
        e = self._executive
        e["propulsion/active_engine"] = -1  # all of them
        if not wanted:
            e["propulsion/starter_cmd"] = 0
            e["propulsion/magneto_cmd"] = 0
            e["propulsion/cutoff_cmd"] = 1
            if self._has_mixture:
                e["fcs/mixture-cmd-norm"] = 0.0
            return
        lit = all(shaft.get_double_value() >= _LIGHT_UP for shaft in self._shafts)
        e["propulsion/starter_cmd"] = float(not self.running)
        e["propulsion/magneto_cmd"] = 3  # both
        e["propulsion/cutoff_cmd"] = float(not lit)
        if self._has_mixture:
            e["fcs/mixture-cmd-norm"] = self._mixture if self._mixture > 0.0 else 1.0
