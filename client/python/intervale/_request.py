"""What a mesh is asked for by: the same keywords for extract(), fetch(), connect() and look()."""

from . import _intervale

KEYWORDS = """range: (low, high), or a list of up to four; not needed for a data set of one range.
        refine: "boundary" (the surfaces of the range) or "uniform" (its inside, too).
        error: the largest error, in the field's units; error_percent: of the data set's largest error, instead.
        roi: ((x, y, z), (x, y, z)), the only box that is refined. camera: a Camera; refines what it sees.
        max_tets, max_updates: budgets, the most important refinement first.
        channels: names of channels that the mesh brings along."""


def _is_pair(range):
    return len(range) == 2 and all(isinstance(end, (int, float)) or getattr(end, "ndim", 1) == 0 for end in range)


def check_count(name, number):
    """ValueError if the number is negative."""
    if number is not None and number < 0:
        raise ValueError(f"{name} is 0 or more, not {number}")


def make_request(range=None, *, refine=None, error=0.0, error_percent=None, roi=None, camera=None, max_tets=None,
                 max_updates=None, channels=()):
    """The request of these keywords; ValueError if they contradict each other, or are no ranges and counts."""
    try:
        ranges = [] if range is None else [range] if _is_pair(range) else list(range)
        ranges = [(float(low), float(high)) for low, high in ranges]
    except (TypeError, ValueError):
        raise ValueError(f"a range is (low, high), not {range!r}") from None
    if error and error_percent is not None:
        raise ValueError("error and error_percent are two ways to say the same: give one of them")
    check_count("max_tets", max_tets)
    check_count("max_updates", max_updates)
    return _intervale.Request(ranges=ranges, refine=refine, error=error, error_percent=error_percent, roi=roi, camera=camera,
                              max_tets=max_tets, max_updates=max_updates, channels=list(channels))
