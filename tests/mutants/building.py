"""A copy of the tree whose core has every mutant of C++ as a switch: one build of what includes a mutated file, the rest as built."""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

from . import switches


def copy_of_tree(root, tree):
    """Copy the files that git lists, and remove sources and tests of an earlier copy that no longer exist."""
    listed = ["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = {n for n in subprocess.run(listed, check=True, capture_output=True, text=True).stdout.split("\0") if (root / n).is_file()}
    for name in names:
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(root / name, tree / name)
    for path in [*tree.glob("tests/**/*.py"), *tree.glob("pycraft/**/*.py")]:
        if str(path.relative_to(tree)) not in names:
            path.unlink()


def dependent_objects(root, files):
    """Objects of the ordinary build that were made from one of these files."""
    ninja = shutil.which("ninja", path=str(pathlib.Path(sys.executable).parent)) or "ninja"
    text = subprocess.run([ninja, "-C", str(root / "build"), "-t", "deps"], check=True, capture_output=True, text=True).stdout
    objects, found, build = set(), set(), root / "build"
    wanted = {str((root / f).resolve()) for f in files}
    for block in text.split("\n\n"):
        head, *rest = block.strip().splitlines() or [""]
        made = head.split(":")[0]
        objects.add(made)
        if any(os.path.normpath(build / line.strip()) in wanted for line in rest):
            found.add(made)
    headers = tuple(
        made.partition("cmake_pch")[0] for made in found if made.endswith(".gch")
    )  # precompiled: their objects do not list them
    return found | {o for o in objects if headers and o.startswith(headers)}


class TestBuild:
    """mutants: those of C++; numbers are their places in `self.mutants`, also of those that are `dropped`, as they do not compile."""

    def __init__(self, root, folder, mutants, jobs, optimisation="1", show=print):
        self.root, self.folder, self.tree = root, pathlib.Path(folder), pathlib.Path(folder) / "tree"
        self.jobs, self.optimisation, self.show = jobs, optimisation, show
        self.dropped = []
        copy_of_tree(root, self.tree)
        self.mutants = without_overlaps(mutants)
        self.originals = {m.file: (self.tree / m.file).read_text(encoding="utf-8") for m in self.mutants}
        self.commands = {
            c["output"].removeprefix(str(root / "build") + "/"): c for c in json.loads((root / "build/compile_commands.json").read_text())
        }
        self.objects = {o: root / "build" / o for o in self.commands if "_core.dir" in o and o.endswith(".o")}  # no precompiled header
        self.write()
        self.compile(sorted(dependent_objects(root, {m.file for m in self.mutants}) & self.objects.keys()))
        self.link()

    def write(self):
        """The mutated files and the switches."""
        by_file = {}
        for number, m in enumerate(self.mutants):
            if m not in self.dropped:
                by_file.setdefault(m.file, []).append((number, m))
        for file, text in self.originals.items():
            (self.tree / file).write_text(switches.instrumented(text, by_file.get(file, [])), encoding="utf-8")
        (self.tree / "cpp/mutants.h").write_text(switches.header(len(self.mutants)), encoding="utf-8")

    def compiled(self, obj):
        """The compiler's complaint, or nothing."""
        made = self.folder / "objects" / obj
        made.parent.mkdir(parents=True, exist_ok=True)
        command = shlex.split(self.commands[obj]["command"].replace(str(self.root / "cpp"), str(self.tree / "cpp")))
        command[command.index("-o") + 1] = str(made)
        if "-include" in command:  # the precompiled header: made of the files as they are, without switches
            del command[command.index("-include") : command.index("-include") + 2]
        together = self.root / "build" / command[command.index("-c") + 1]
        if "Unity" in together.parts:  # sources that are compiled together: a file of CMake's that includes them
            copy = made.with_suffix(".together.cxx")
            copy.write_text(together.read_text(encoding="utf-8").replace(str(self.root / "cpp"), str(self.tree / "cpp")), encoding="utf-8")
            command[command.index("-c") + 1] = str(copy)
        command += [f"-O{self.optimisation}", "-w", "-include", str(self.tree / "cpp/mutants.h")]
        launcher = shlex.split(os.environ.get("CMAKE_CXX_COMPILER_LAUNCHER", ""))
        run = subprocess.run([*launcher, *command], capture_output=True, text=True, cwd=self.root / "build")
        self.objects[obj] = made
        return run.stderr if run.returncode else ""

    def compile(self, objects):
        self.show(f"{len(self.mutants)} mutants of C++; {len(objects)} of {len(self.objects)} objects to compile")
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            while objects:
                complaints = list(pool.map(self.compiled, objects))
                objects = [o for o, complaint in zip(objects, complaints, strict=True) if complaint]
                if objects:
                    self.drop("\n".join(complaints))

    def drop(self, complaint):
        """Mutants on lines that the compiler names: what does not compile is no mutant."""
        named = set(re.findall(rf"{re.escape(str(self.tree))}/(cpp/[\w/.]+):(\d+)", complaint))
        bad = [m for m in self.mutants if (m.file, str(m.line)) in named and m not in self.dropped]
        errors = re.findall(rf"{re.escape(str(self.tree))}/(cpp/[\w/.]+):(\d+):\d+: error", complaint)
        exact = [m for m in bad if (m.file, str(m.line)) in set(errors)]
        bad = exact or bad
        if not bad:
            raise SystemExit(f"the test build does not compile:\n{complaint[:3000]}")
        for m in bad:
            self.show(f"does not compile: {m.file}:{m.line} {m.change}")
        self.dropped += bad
        self.write()

    def link(self):
        core = next(p for p in (self.root / "build").glob("_core*.so"))
        ninja = shutil.which("ninja", path=str(pathlib.Path(sys.executable).parent)) or "ninja"
        last = subprocess.run(
            [ninja, "-C", str(self.root / "build"), "-t", "commands", "_core"], check=True, capture_output=True, text=True
        ).stdout
        libraries = re.findall(r"libpycraft_core\.a([^&\n]*)", last.strip().splitlines()[-1])[-1]
        target = self.tree / "pycraft" / core.name
        command = [
            "g++" if "g++" in last else "c++",
            "-shared",
            "-fPIC",
            "-o",
            str(target),
            *map(str, self.objects.values()),
            *shlex.split(libraries),
        ]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode:
            raise SystemExit(f"the test build does not link:\n{run.stderr[-2000:]}")


KERNELS = "cpp/tests/test_kernels.cpp"


def kernels(build):
    """The C++ tests of small kernels, built with the switches: a program that ends with 0 where all pass."""
    source = build.tree / KERNELS
    made = build.folder / f"test_kernels-{hashlib.sha256(source.read_bytes()).hexdigest()[:12]}"
    if made.exists():
        return made
    like = next(c["command"] for o, c in build.commands.items() if "/cpp/tests/" in o)
    flags = shlex.split(like.replace(str(build.root / "cpp"), str(build.tree / "cpp")))
    at = flags.index("-o")
    flags[at : at + 4] = []  # -o object -c source
    core = [str(path) for name, path in build.objects.items() if "pycraft_core.dir" in name]
    command = [*flags, "-O1", "-w", "-include", str(build.tree / "cpp/mutants.h"), str(source), *core, "-o", str(made)]
    run = subprocess.run([*command, "-lquadmath", "-lpthread"], capture_output=True, text=True, cwd=build.root / "build")
    if run.returncode:
        raise SystemExit(f"{KERNELS} does not build with the switches:\n{run.stderr[-2000:]}")
    return made


def without_overlaps(mutants):
    """Where two places overlap the one that was listed by hand stays."""
    kept, taken = [], {}
    for m in sorted(mutants, key=lambda m: not m.name):
        spans = taken.setdefault(m.file, [])
        if all(m.end <= begin or end <= m.begin or (m.begin == m.end) for begin, end in spans):
            spans.append((m.begin, m.end))
            kept.append(m)
    return sorted(kept, key=lambda m: (m.file, m.begin))
