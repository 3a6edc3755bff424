"""Run a build and show how far it is: python cpp/build_progress.py -- COMMAND ...

Ninja's lines "[12/210] Building ..." become one line that is written over: what is compiled, how many of how many, and the time left. In a
file or pipe it is a line every ten seconds. All output goes to build/build.log; what failed is shown.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

STEP = re.compile(r"\[(\d+)/(\d+)\] (?:Building \w+ object (?:\S*\.dir/)?(?P<source>\S+?)(?:\.o)?$|(?P<other>.*))")
LOG = Path("build/build.log")
SHOWN = 60


def left(seconds: float) -> str:
    """A duration in minutes and seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def main(command: list[str]) -> int:
    """Run the command; its exit status."""
    LOG.parent.mkdir(exist_ok=True)
    terminal, began, said, width = sys.stdout.isatty(), 0.0, 0.0, 0
    with LOG.open("w", encoding="utf-8") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        assert process.stdout is not None
        for line in process.stdout:
            log.write(line)
            step = STEP.search(line.strip())
            now = time.monotonic()
            if step is None:
                continue
            done, all_of_it = int(step[1]), int(step[2])
            began = began or now
            if not terminal and now - said < 10 and done < all_of_it:
                continue
            said = now
            rest = f", {left((now - began) / done * (all_of_it - done))} left" if now - began > 10 and done < all_of_it else ""
            what = (step["source"] or step["other"] or "").strip()[-SHOWN:]
            text = f"compiling {done} of {all_of_it}{rest}: {what}"
            print(f"\r{text.ljust(width)}" if terminal else text, end="" if terminal else "\n", flush=True)
            width = len(text)
        status = process.wait()
    if terminal and width:
        print(f"\r{' ' * width}\r", end="", flush=True)
    if status:
        lines = LOG.read_text(encoding="utf-8").splitlines()
        failed = next(
            (i for i, line in enumerate(lines) if line.startswith("FAILED:") or "error:" in line.lower()), max(0, len(lines) - 40)
        )
        print("\n".join(lines[failed : failed + 60]))
        print(f"the build failed; {LOG} has all of its output")
    return status


if __name__ == "__main__":
    arguments = sys.argv[1:]
    sys.exit(main(arguments[arguments.index("--") + 1 :] if "--" in arguments else arguments))
