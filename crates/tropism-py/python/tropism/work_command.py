"""What the command line starts for the engine ray, and for a sweep at an fsspec address.

An object of JSON on stdin says what to do: `workflow`, `plan` (None goes on with the sweep at the address `out`), `engine`,
`address` and `threads`. Of a work in a folder only the units are executed, for the command collects the results. Of a sweep at an
address the results go to stdout, as JSON. Options of the address's file system come from where it looks for them itself, such as
`AWS_ENDPOINT_URL`, and from fsspec's settings, such as `FSSPEC_S3_ENDPOINT_URL`.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from tropism.errors import TropismError
from tropism.plan import Plan
from tropism.plans import SweepPlan
from tropism.ray_engine import execute_units
from tropism.storage import is_address, plan_at
from tropism.sweeps import sweep
from tropism.workflows import PLANS


def execute_order(order: dict[str, Any]) -> None:
    """Executes the work of an order, and prints its results if it is at an address."""
    out, engine, address = order["out"], order["engine"], order.get("address")
    # A cluster that is started here has the threads of this command.
    workers = order.get("threads") if engine == "ray" and address is None else None
    if order.get("plan") is None:
        plan: Plan[Any] = plan_at(out)
    else:
        plan = PLANS[order["workflow"]](**order["plan"])
    if isinstance(plan, SweepPlan) and is_address(out):
        threads = None if engine == "ray" else order.get("threads")
        results = sweep(plan, engine=engine, threads=threads, address=address, workers=workers)
        print(json.dumps(results.to_dict()))
    else:
        execute_units(plan, threads=1, retries=3, address=address, workers=workers)


def main() -> int:
    """Executes the order on stdin: 0 if all went well, 1 after an error, 130 after an interruption."""
    order = json.load(sys.stdin)
    try:
        execute_order(order)
    except KeyboardInterrupt:
        return 130
    except (TropismError, OSError) as error:
        # The keys of the plan as options of the command.
        text = str(error).replace("`resume`", "--resume").replace("`out`", "--out")
        print(text, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
