"""Networks as ONNX models: one matrix product and one activation a neuron, in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from tropism._core import Genome

#: The first version of the operators' set that has all of them in double precision.
OPSET = 17


class _Graph:
    """Nodes and constants of a model, with names of their own."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []

    def constant(self, value: Any, dtype: Any = np.float64) -> str:
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, dtype=dtype), name))
        return name

    def add(self, operator: str, *inputs: str, output: str | None = None, **attributes: Any) -> str:
        name = output if output is not None else f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], **attributes))
        return name


def _activated(graph: _Graph, x: str, activation: str, a: float, b: float) -> str:
    """The activation function of `tropism_neat::Activation`, of the weighted sum `x`."""
    c, add = graph.constant, graph.add

    def step(threshold: float, low: float) -> str:
        return add("Where", add("Greater", x, c(threshold)), c(1.0), c(low))

    def scaled(scale: float, shift: float) -> str:
        return add("Add", add("Mul", x, c(scale)), c(shift))

    def sigmoid() -> str:
        # As it is written in Rust: Sigmoid differs in its last bits from machine to machine.
        return add("Div", c(1.0), add("Add", c(1.0), add("Exp", scaled(-a, -b))))

    def gauss() -> str:
        return add("Exp", add("Add", add("Mul", add("Mul", x, x), c(-a)), c(b)))

    def signed(value: str) -> str:
        return add("Sub", add("Mul", value, c(2.0)), c(1.0))

    match activation:
        case "unsigned_step":
            return step(0.5 + b, 0.0)
        case "signed_step":
            return step(b, -1.0)
        case "unsigned_sigmoid":
            return sigmoid()
        case "signed_sigmoid":
            return signed(sigmoid())
        case "tanh":
            return add("Tanh", add("Mul", x, c(a)))
        case "unsigned_gauss":
            return gauss()
        case "signed_gauss":
            return signed(gauss())
        case "abs":
            return add("Abs", add("Add", x, c(b)))
        case "sine":
            return add("Sin", scaled(a, b))
        case "linear":
            return add("Add", x, c(b))
        case "relu":
            return add("Max", x, c(0.0))
        case "softplus":
            return add("Where", add("Greater", x, c(40.0)), x, add("Log", add("Add", c(1.0), add("Exp", x))))
    raise ValueError(f"found activation {activation!r}, wanted one of tropism's")


def _order(genome: Genome) -> list[int]:
    """Places of the neurons beyond inputs and bias, each after those that it reads, of a feed-forward network."""
    places = {neuron[0]: place for place, neuron in enumerate(genome.neurons)}
    first = genome.inputs + 1
    reads: dict[int, set[int]] = {place: set() for place in range(first, len(places))}
    for _, start, end, _ in genome.links:
        if places[start] >= first:
            reads[places[end]].add(places[start])
    order: list[int] = []
    while reads:
        free = [place for place, sources in reads.items() if not sources - set(order)]
        order.extend(free)
        for place in free:
            del reads[place]
    return order


def exported(genome: Genome) -> onnx.ModelProto:
    """The model of `tropism.neat.to_onnx`."""
    graph = _Graph()
    neurons = genome.neurons
    places = {neuron[0]: place for place, neuron in enumerate(neurons)}
    incoming: dict[int, list[tuple[int, float]]] = {place: [] for place in range(len(neurons))}
    for _, start, end, weight in genome.links:
        incoming[places[end]].append((places[start], weight))
    first = genome.inputs + 1
    recurrent = not genome.is_feed_forward
    # Columns of all neurons before the step (recurrent), or as they become known (feed-forward).
    rows = graph.add("Gather", graph.add("Shape", "inputs"), graph.constant([0], np.int64), axis=0)
    shape = graph.add("Concat", rows, graph.constant([1], np.int64), axis=0)
    columns: dict[int, str] = {}

    def column_of(source: str, place: int) -> str:
        return graph.add("Gather", source, graph.constant([place], np.int64), axis=1)

    for place in range(genome.inputs):
        columns[place] = column_of("inputs", place)
    columns[genome.inputs] = graph.add("Expand", graph.constant([[1.0]]), shape)
    order = range(first, len(neurons)) if recurrent else _order(genome)
    if recurrent:
        for place in order:
            columns[place] = column_of("state", place)
    becomes = dict(columns)
    for place in order:
        # In the order in which Rust adds: inputs and bias first, by place, then the others as the genes stand.
        own = incoming[place]
        near = sorted((link for link in own if link[0] < genome.inputs), key=lambda link: link[0])
        far = [link for link in own if link[0] >= genome.inputs]
        known = columns if recurrent else becomes
        sums = []
        for links in (near, far):
            total = graph.add("Mul", columns[genome.inputs], graph.constant(0.0))
            for source, weight in links:
                total = graph.add("Add", total, graph.add("Mul", known[source], graph.constant(weight)))
            sums.append(total)
        _, _, _, activation, a, b = neurons[place]
        becomes[place] = _activated(graph, graph.add("Add", *sums), activation, a, b)

    def joined(chosen: range, name: str) -> None:
        graph.add("Concat", *(becomes[place] for place in chosen), output=name, axis=1)

    def value(name: str, width: int) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["rows", width])

    joined(range(first, first + genome.outputs), "outputs")
    inputs, outputs = [value("inputs", genome.inputs)], [value("outputs", genome.outputs)]
    if recurrent:
        joined(range(len(neurons)), "next_state")
        inputs.append(value("state", len(neurons)))
        outputs.append(value("next_state", len(neurons)))
    proto = helper.make_graph(graph.nodes, "tropism", inputs, outputs, graph.constants)
    model = helper.make_model(proto, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="tropism")
    model.ir_version = 8
    onnx.checker.check_model(model)
    return model
