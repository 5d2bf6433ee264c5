"""What a study will cost, said before it is paid for."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import Any

from ..execution.costs import Plan
from ..study.study import Study
from .output import print_json

# What takes longer [s] is announced.
_LONG = 30.0


def plan_of(study: Study, method: str, given: dict[str, Any], options: argparse.Namespace) -> Plan | None:
    """The plan of a method of a study, printed if it was asked for or takes long; None if it is short.

    What is clearly short after two runs is not worth more of them.
    """
    plan = study.plan(method, probes=2, **given)
    if options.plan or plan.seconds > _LONG / 3.0:
        plan = study.plan(method, **given)
    if options.plan:
        if options.json:
            print_json({"plan": dataclasses.asdict(plan)})
        else:
            print(plan)
        return plan
    if plan.seconds <= _LONG:
        return None
    if not options.quiet:
        print(f"plan: {plan}", file=sys.stderr)
    return plan
