"""A plant model of your own in PyTorch, an LSTM of the tip: python lstm_model.py [GENERATIONS] (pip install torch)

It is trained on tracks of virtual beans to predict the next shift of the tip from the light, the place and the last shift
(Hochreiter and Schmidhuber 1997, doi:10.1162/neco.1997.9.8.1735). As a `tropism.loop.PlantModel` it stands wherever a model of
the core does: networks evolve on it, and the champion steers a bean that neither of them saw. Each track is learnt in a
mirror, too (section 2.2.3).
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import nn
from tropism import loop
from tropism.loop import Noise, PlantModel
from tropism.tracks import Track

#: Units of the LSTM, passes over the tracks, and the step of Adam: chosen by hand.
UNITS, EPOCHS, LEARNING_RATE = 24, 150, 0.01
#: Shifts and places are divided by these, in cm, so that inputs and outputs are of size 1.
SHIFT_CM, PLACE_CM = 0.2, 5.0
Point = tuple[float, float]


def inputs(side: np.ndarray, tip: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """(..., 5): the side of the lit lamp, the place of the tip, and its last shift."""
    place = (tip - [0.0, 9.0]) / PLACE_CM
    return np.concatenate([side[..., None], place, shift / SHIFT_CM], axis=-1).astype(np.float32)


class Lstm(nn.Module):
    """Inputs of each step to the shift of the tip, and the state."""

    def __init__(self) -> None:
        super().__init__()
        self.memory = nn.LSTM(5, UNITS, batch_first=True)
        self.shift = nn.Linear(UNITS, 2)

    def forward(self, seen: torch.Tensor, state: Any = None) -> tuple[torch.Tensor, Any]:
        remembered, state = self.memory(seen, state)
        return self.shift(remembered), state


class LstmModel(PlantModel):
    """The trained network as a model. A plant is its tip, its last shift, and the state of the network."""

    def __init__(self, network: Lstm, sd: Sequence[float]) -> None:
        self.network, self.sd = network, np.array(sd)

    @classmethod
    def fit(cls, tracks: Sequence[Track], epochs: int = EPOCHS, seed: int = 1) -> "LstmModel":
        """Trains on tracks of equal length without gaps."""
        torch.manual_seed(seed)
        tips = np.array([track.tips for track in tracks])
        sides = np.array(
            [[{"left": -1.0, "right": 1.0}.get(word, 0.0) for word in track.columns()["light"]] for track in tracks]
        )
        tips, sides = np.concatenate([tips, tips * [-1, 1]]), np.concatenate([sides, -sides])
        shifts = np.diff(tips, axis=1)
        seen = torch.from_numpy(inputs(sides[:, 1:-1], tips[:, 1:-1], shifts[:, :-1]))
        wanted = torch.from_numpy((shifts[:, 1:] / SHIFT_CM).astype(np.float32))
        network = Lstm()
        optimizer = torch.optim.Adam(network.parameters(), LEARNING_RATE)
        for _ in range(epochs):
            optimizer.zero_grad()
            error = network(seen)[0] - wanted
            (error**2).mean().backward()
            optimizer.step()
        # The noise of a step is the residual of the shifts.
        return cls(network, (error.detach().std(dim=(0, 1)) * SHIFT_CM).tolist())

    def seedling(self, start: Point, noise: Noise) -> Any:
        return np.array(start), np.zeros(2), None

    def step(self, plant: Any, light: int, noise: Noise) -> Any:
        tip, shift, state = plant
        seen = inputs(np.array([2.0 * light - 1.0]), tip[None], shift[None])
        with torch.no_grad():
            expected, state = self.network(torch.from_numpy(seen), state)
        shift = SHIFT_CM * expected[0].double().numpy() + self.sd * [noise.normal(), noise.normal()]
        return tip + shift, shift, state

    def observe(self, plant: Any) -> Point:
        return float(plant[0][0]), float(plant[0][1])


def main(generations: int = 20) -> None:
    """Trains on six beans, evolves on the model, and steers a bean that was left out."""
    torch.set_num_threads(1)
    task = {"kind": "open_loop", "max_steps": 500}
    tracks = [loop.grow({"kind": "periodic", "minutes": 360}, task, seed)[0] for seed in range(1, 7)]
    model = LstmModel.fit(tracks)
    print(f"trained on {len(tracks)} beans; residual of a step: {model.sd[0]:.3f} and {model.sd[1]:.3f} cm")
    print(f"the greedy rule on the model: {loop.simulate(model)[1]:.2f} cm, on a bean: {loop.grow(seed=100)[1]:.2f} cm")
    evolved = loop.evolve(model, runs=1, generations=generations, neat={"population": 20})[0]
    champion = loop.NetworkController(evolved.genome)
    print(f"the champion on the model: {evolved.fitness:.2f} cm, on a bean: {loop.grow(champion, seed=100)[1]:.2f} cm")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
