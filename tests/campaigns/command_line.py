"""Command lines of the campaigns: their common part."""

import argparse
import time


def seeds(document, count, first=True):
    """The seeds that the command line asks for, `count` of them where it does not."""
    parser = argparse.ArgumentParser(description=document, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=count)
    if first:
        parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    begin = given.first if first else 0
    return range(begin, begin + given.seeds)


def tallied(seeds, each, words, every=60.0):
    """Run `each(seed)`, (how many comparisons, what is wrong, line by line), show it, and sum up; the exit status.

    Says every so many seconds how far it is.
    """
    compared, wrong = 0, []
    said_at = begin = time.perf_counter()
    for done, seed in enumerate(seeds, 1):
        count, lines = each(seed)
        compared += count
        wrong += lines
        for line in lines:
            print(line, flush=True)
        if time.perf_counter() - said_at > every:
            said_at = time.perf_counter()
            print(f"{said_at - begin:.0f} s, {done} of {len(seeds)} seeds: {compared} {words}, {len(wrong)} wrong", flush=True)
    print(f"{compared} {words}, {len(wrong)} wrong")
    return 1 if wrong else 0


def listed(wrong, most=40):
    """Show what is wrong; the exit status."""
    print("\n".join(wrong[:most]))
    return f"{len(wrong)} wrong" if wrong else 0
