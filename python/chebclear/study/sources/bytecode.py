"""What a function looks up in its surroundings, read from its bytecode."""

from __future__ import annotations

import builtins
import dis
import importlib
import sys
from collections.abc import Iterator, Mapping
from itertools import pairwise, takewhile
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

MISSING = object()
"""What is looked up and not there."""

# Instructions between an import and the place where it is stored.
_STACK = ("SWAP", "ROT_TWO", "COPY", "POP_TOP")
# Instructions whose name is not that of a variable, and those that hand a variable on to a function inside.
_NO_USE = ("LOAD_CONST", "LOAD_ATTR", "LOAD_METHOD", "LOAD_SUPER_ATTR", "LOAD_SPECIAL", "LOAD_CLOSURE")


class Use(NamedTuple):
    """A value that a function looks up."""

    names: tuple[str, ...]
    """The name, and those of attributes of modules that follow it."""
    module: ModuleType | None
    """The module that has the last name; None for a variable of the function's own module or of a function
    around it."""
    value: Any
    """What was found, or `MISSING`."""


def uses(function: FunctionType) -> Iterator[Use]:
    """What a function, with all functions inside it, looks up around it; some of it more than once.

    Attributes of modules are followed as far as they are written: `a.b.c` is one value, not all of `a`. A
    module that is used in any other way is itself the value.
    """
    codes = list(all_codes(function.__code__))
    instructions = [
        [one for one in dis.get_instructions(code) if one.opname not in ("EXTENDED_ARG", "CACHE")]
        for code in codes
    ]
    imported: dict[str, list[Any]] = {}
    for name, value in (pair for some in instructions for pair in _imports(some, function.__globals__)):
        imported.setdefault(name, []).append(value)
        if not isinstance(value, ModuleType):
            yield Use((name,), None, value)
    around = enclosed(function)
    for code, some in zip(codes, instructions, strict=True):
        cells = {*code.co_cellvars, *code.co_freevars}
        for place, one in enumerate(some):
            for left, name in enumerate(reversed(_loaded(one))):
                # Of two that are loaded at once, what follows belongs to the last.
                attributes = [] if left else [*takewhile(_is_attribute, some[place + 1 :])]
                if "FAST" in one.opname and name in cells:  # handed on to a function inside, as LOAD_CLOSURE
                    continue
                if name in imported:
                    values = imported[name]
                elif "FAST" in one.opname:
                    continue
                elif name in around:
                    values = [around[name]]
                elif "DEREF" in one.opname:
                    continue
                elif name in function.__globals__:
                    values = [function.__globals__[name]]
                else:
                    yield Use((name,), builtins, getattr(builtins, name, MISSING))
                    continue
                for value in values:
                    yield _followed(name, value, [after.argval for after in attributes])


def all_codes(code: CodeType) -> Iterator[CodeType]:
    """The code of a function and of all functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from all_codes(constant)


def _loaded(instruction: dis.Instruction) -> tuple[str, ...]:
    """Names of the variables that an instruction loads; newer Pythons may load two, or store one before."""
    if "LOAD_" not in instruction.opname or instruction.opname in _NO_USE:
        return ()
    names = instruction.argval if isinstance(instruction.argval, tuple) else (instruction.argval,)
    if instruction.opname.startswith("STORE_"):
        names = names[1:]
    return tuple(name for name in names if isinstance(name, str))


def _is_attribute(instruction: dis.Instruction) -> bool:
    return instruction.opname in ("LOAD_ATTR", "LOAD_METHOD")


def _followed(name: str, value: Any, attributes: list[str]) -> Use:
    use = Use((name,), None, value)
    for attribute in attributes:
        if not isinstance(use.value, ModuleType) or attribute == "__dict__":
            break
        use = Use((*use.names, attribute), use.value, getattr(use.value, attribute, MISSING))
    return use


def enclosed(function: FunctionType) -> dict[str, Any]:
    """The variables of the functions around it; those without a value are missing."""
    found = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            found[name] = cell.cell_contents
        except ValueError:
            found[name] = MISSING
    return found


def _imports(instructions: list[dis.Instruction], around: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """What a function imports, with the names that it gives it; one name may stand for several."""
    for place, one in enumerate(instructions):
        if one.opname != "IMPORT_NAME":
            continue
        level, listed = (before.argval for before in instructions[place - 2 : place])
        path = "." * level + one.argval
        held = last = _module(path, str(around.get("__package__") or ""), bool(listed))
        following = instructions[place + 1 :]
        for after, then in pairwise(following):
            if after.opname == "IMPORT_FROM":
                last = _attribute(held, after.argval)
                if not then.opname.startswith("STORE_"):  # import a.b as c
                    held = last
            elif after.opname.startswith("STORE_"):
                yield after.argval[0] if isinstance(after.argval, tuple) else after.argval, last
            elif after.opname not in _STACK:
                break


def _module(path: str, package: str, innermost: bool) -> Any:
    """What `import path` gives: the outermost module, or the innermost for `from path import ...`."""
    try:
        module = importlib.import_module(path, package)
    except Exception:  # whatever a module does that cannot be imported
        return MISSING
    return module if innermost else sys.modules[path.partition(".")[0]]


def _attribute(module: Any, name: str) -> Any:
    """What `from module import name` gives."""
    found = getattr(module, name, MISSING)
    if found is MISSING and isinstance(module, ModuleType):
        return _module(f"{module.__name__}.{name}", "", innermost=True)
    return found
