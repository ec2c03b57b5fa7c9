"""Compile the kernel and the tasks to WebAssembly modules, from Numba's own intermediate code, and write down names and numbers for the page.

``python web/build_kernel.py`` needs the extra ``web`` (llvmlite's wasm32 target comes with Numba, the linker with ``ziglang``) and writes, in
``src``, ``kernel/kernel.wasm`` and ``kernel/layout.ts``, ``tasks/tasks.wasm`` and ``tasks/tasks.json``, and ``physics/vehicle_data.ts``. All are
kept in the repository. A module carries a digest of the sources it was compiled from: one that is not stale is not compiled again.
"""

from __future__ import annotations

import argparse
import ast
import base64
import hashlib
import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

WEB = Path(__file__).parent
MODULE = WEB / "src" / "kernel" / "kernel.wasm"
LAYOUT = WEB / "src" / "kernel" / "layout.ts"
TASKS = WEB / "src" / "tasks" / "tasks.json"
VEHICLES = WEB / "src" / "physics" / "vehicle_data.ts"
_SECTION, _DIGEST_SIZE = "sources", 64  # the custom section with the digest

# Code for no processor in particular, and one number at a time: WebAssembly takes what is left
_NUMBA = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
}
_TRIPLE = "wasm32-unknown-unknown"
_LLVM_TYPES = {
    "none": "void",
    "float64": "double",
    "int32": "i32",
    "int64": "i64",
    "float64*": "ptr",
    "void*": "ptr",
}


class Part(NamedTuple):
    """A module of the page: the file with its entries, the packages whose files count as its sources, and the linker's options."""

    path: Path
    entries: str
    packages: tuple[str, ...]
    link: tuple[str, ...]


KERNEL = Part(
    MODULE,
    "kernel_entries",
    ("lean_yaw_env.kernel",),
    ("-target", "wasm32-freestanding", "-fno-entry"),
)
# Sines and logarithms of the tasks are the C library's
TASKS_PART = Part(
    WEB / "src" / "tasks" / "tasks.wasm",
    "task_entries",
    ("lean_yaw_env.kernel", "lean_yaw_env.envs"),
    ("-target", "wasm32-wasi", "-lc", "-mexec-model=reactor"),
)


def sources(part: Part = KERNEL) -> list[Path]:
    """The files that a module is compiled from: the page's, and those of its packages that they import, directly or not."""
    found = {WEB / "runtime.c"}
    waiting = [WEB / f"{part.entries}.py"]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(part.packages):
                home = WEB.parent.joinpath(*(node.module or "").split("."))
                names = [home / alias.name for alias in node.names] + [home]
                files = [name.with_suffix(".py") for name in names]
                files += [home / "__init__.py"] if "TASKS" in {a.name for a in node.names} else []
                waiting += [file for file in files if file.exists()]
    return sorted(found)


def digest_of_sources(part: Part = KERNEL) -> str:
    digest = hashlib.sha256()
    for path in sources(part):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def is_stale(part: Part) -> bool:
    return not part.path.exists() or digest_in(part.path.read_bytes()) != digest_of_sources(part)


def digest_in(module: bytes) -> str:
    """The digest that a module carries, in a custom section at its end; empty if it has none."""
    end = module[-len(_SECTION) - _DIGEST_SIZE :].decode("ascii", "replace")
    return end.removeprefix(_SECTION) if end.startswith(_SECTION) else ""


def _with_digest(module: bytes, digest: str) -> bytes:
    content = bytes([len(_SECTION)]) + (_SECTION + digest).encode()
    assert len(digest) == _DIGEST_SIZE and len(content) < 0x80  # one byte of a length in LEB128
    return module + bytes([0, len(content)]) + content


def _intermediate_codes(entries: dict[Any, Any]) -> list[tuple[str, str]]:
    """Numba's optimised code of each entry, and the name of its function there."""
    from numba import njit

    compiled: Any = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    codes = []
    for function, signature in entries.items():
        print(f"compiling {function.__name__}", flush=True)
        dispatcher = compiled(function)
        dispatcher.compile(signature.args)
        (only,) = dispatcher.signatures
        codes.append(
            (dispatcher.inspect_llvm(only), dispatcher.overloads[only].fndesc.mangled_name)
        )
    return codes


def _for_wasm(code: str) -> str:
    """The same code without what belongs to the machine it was made for, or to Python."""
    code = re.sub(r'^target (datalayout|triple) = ".*"$', "", code, flags=re.MULTILINE)
    code = re.sub(r"= common (local_unnamed_addr )?global", "= internal global", code)
    # Numba counts the owners of arrays; here they live until the next call
    code = re.sub(
        r"^define linkonce_odr void @(NRT_\w+)\(.*?^}$",
        r"declare void @\1(ptr)",
        code,
        flags=re.MULTILINE | re.DOTALL,
    )
    code = re.sub(r'"(target-cpu|target-features)"="[^"]*"', "", code)
    code = re.sub(r"@llvm\.fma\.f64\b", "@fused_multiply_add", code)
    return code


def _exports(
    entries: dict[Any, Any], codes: list[tuple[str, str]], forgetting: dict[Any, Any]
) -> str:
    """Functions with plain arguments around Numba's, whose first two are where the result and an exception go."""
    lines = ["declare void @forget_blocks()"]
    for (function, signature), (_, name) in zip(entries.items(), codes, strict=True):
        kinds = [_LLVM_TYPES[str(kind)] for kind in signature.args]
        result = _LLVM_TYPES[str(signature.return_type)]
        place = "ptr" if result == "void" else result
        named = ", ".join(f"{kind} %{k}" for k, kind in enumerate(kinds))
        lines += [
            f'declare i32 @"{name}"(ptr, ptr, {", ".join(kinds)})',
            f"define {result} @{function.__name__}({named}) {{",
            f"  %result = alloca {place}",
            "  %exception = alloca ptr",
            *(["  call void @forget_blocks()"] if function in forgetting else []),
            f'  %status = call i32 @"{name}"(ptr %result, ptr %exception, {named})',
        ]
        if result == "void":
            lines.append("  ret void")
        else:
            lines += [f"  %value = load {result}, ptr %result", f"  ret {result} %value"]
        lines.append("}")
    return "\n".join(lines)


def _object(exported: dict[Any, Any], apart: dict[Any, Any]) -> bytes:
    """Machine code for WebAssembly of all entries, and of what they call by its name."""
    from llvmlite import binding

    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    machine = binding.Target.from_triple(_TRIPLE).create_target_machine(opt=2, reloc="static")
    target = f'target datalayout = "{machine.target_data}"\ntarget triple = "{_TRIPLE}"\n'
    entries = exported | apart
    codes = _intermediate_codes(entries)
    module = binding.parse_assembly(target + _exports(entries, codes, exported))
    for code, _ in codes:
        module.link_in(binding.parse_assembly(target + _for_wasm(code)))
    names = {function.__name__ for function in exported}
    for function in module.functions:
        if not function.is_declaration and function.name not in names:
            function.linkage = binding.Linkage.internal
    tuning = binding.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_vectorization = tuning.slp_vectorization = tuning.loop_unrolling = False
    builder = binding.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def _linked(code: bytes, exported: list[str], options: tuple[str, ...]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "kernel.o").write_bytes(code)
        subprocess.run(
            [
                sys.executable, "-m", "ziglang", "build-exe", "kernel.o", str(WEB / "runtime.c"),
                *options, "-O", "ReleaseFast", "-fstrip", "-fcompiler-rt",
                "--stack", "65536", *(f"--export={name}" for name in exported), "--name", "linked",
            ],
            cwd=place,
            check=True,
        )  # fmt: skip
        return (place / "linked.wasm").read_bytes()


def build(part: Part) -> bytes:
    """Compile a module."""
    named = importlib.import_module(part.entries)
    shared = ["shared_rows", "shared_size", "fused_multiply_add"]
    exported = [function.__name__ for function in named.ENTRIES] + shared
    code = _object(named.ENTRIES, getattr(named, "APART", {}))
    return _with_digest(_linked(code, exported, part.link), digest_of_sources(part))


def layout() -> str:
    """What the page must know of the module's rows, as TypeScript."""
    import kernel_entries as entries

    from lean_yaw_env.kernel import records

    statuses = [
        "STEPPED",
        "BACKWARD",
        "SIDEWAYS",
        "TRIP",
        "LIFT_OFF",
        "SLIP",
        "NO_STRIKE",
        "FAILED",
    ]
    tables = {
        "BODY": entries.Body._fields,
        "COMMAND": entries.Command._fields,
        "OUTCOME": entries.Outcome._fields,
        "TRACE": entries.COLUMNS,
        "OUTPUTS": entries.OUTPUTS,
        "PASSIVE_OUTCOME": entries.PassiveOutcome._fields,
    }
    numbers = ["INPUTS", "STATE_SIZE", "PASSIVE_INPUTS", "PASSIVE_STATE_SIZE", "PASSIVE_COLUMNS"]
    named = ", ".join(f"{name}: {getattr(records, name):g}" for name in statuses)
    return "\n".join([
        "// Written by build_kernel.py from the kernel's records; do not edit.", "",
        *(f"export const {name} = {json.dumps(list(names))} as const;" for name, names in tables.items()),
        *(f"export const {name} = {getattr(entries, name)};" for name in numbers),
        f"export const STATUS = {{ {named} }} as const;", "",
    ])  # fmt: skip


def vehicles() -> str:
    """The package's bicycles and skateboard as TypeScript: SI units."""
    from lean_yaw_env.vehicles import BENCHMARK_2007, Skateboard, parameters_2005

    tables = {
        "PAPER_BICYCLE": asdict(parameters_2005()),
        "BENCHMARK_BICYCLE": asdict(BENCHMARK_2007),
        "SKATEBOARD": asdict(Skateboard()),
    }
    return "\n".join([
        "// Written by build_kernel.py from lean_yaw_env.vehicles; do not edit. SI units, angles in radians.", "",
        *(f"export const {name} = {json.dumps(table, indent=2)};" for name, table in tables.items()), "",
    ])  # fmt: skip


def tasks() -> dict[str, Any]:
    """What the page must know of the tasks: records, settings, and what to show."""
    import numpy as np
    from task_entries import TASKS as offered

    from lean_yaw_env.envs.options import EnvOptions, settings_of
    from lean_yaw_env.envs.state import WALKER
    from lean_yaw_env.registration import TASK_VERSIONS

    def fields(record: np.dtype) -> dict[str, Any]:
        """Place of each field in words of eight bytes; -1 less the place of a count."""
        places = record.fields or {}
        return {
            name: -1 - place // 8 if kind.base.kind in "iu" else place // 8
            for name, (kind, place, *_) in places.items()
        }

    def as_text(record: np.ndarray) -> str:
        return base64.b64encode(record.tobytes()).decode()

    described: dict[str, Any] = {}
    for task in offered:
        options = EnvOptions()
        own = options.for_task(task)
        settings = settings_of(options, task)
        described[task.name] = {
            "id": f"{task.name}-v{TASK_VERSIONS[task.name]}",
            "summary": task.summary,
            "reward": task.reward_text,
            "fields": fields(task.record),
            "initial": as_text(task.initial),
            "settings": as_text(settings),
            "body": as_text(np.array(own.parameters.body())),
            "horizon": own.horizon,
            "observation": list(options.observation_names(task)),
            "metrics": {key: list(metric[:3]) for key, metric in task.metrics.items()},
            "headline": task.headline,
            "heading": task.heading_field,
            "goal": task.goal_fields,
            "radius": task.goal_radius,
            "pump": task.pumping / options.mass_offset_range,
        }
    return {"walker": fields(WALKER), "tasks": described}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="only say whether a module is stale")
    check = parser.parse_args().check
    os.environ.update(_NUMBA)
    for part in (KERNEL, TASKS_PART):
        if not is_stale(part):
            continue
        if check:
            sys.exit(f"{part.path.name} is stale: run web/build_kernel.py")
        module = build(part)
        part.path.parent.mkdir(parents=True, exist_ok=True)
        part.path.write_bytes(module)
        print(f"{part.path}: {len(module)} bytes")
    if not check:
        LAYOUT.write_text(layout())
        VEHICLES.write_text(vehicles())
        TASKS.write_text(json.dumps(tasks()) + "\n")


if __name__ == "__main__":
    main()
