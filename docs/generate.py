"""Pages and figures of the documentation that are made from the code, so that they cannot be out of date."""

import re
import warnings
from pathlib import Path

import chebclear as cc
import matplotlib
import matplotlib.patches as patches
import numpy as np
from chebclear.notices import CODES
from files import files_page
from gallery import example_pages
from matplotlib.figure import Figure

STYLE = {"font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3}


def everything(folder: Path) -> None:
    """All of them."""
    folder.mkdir(exist_ok=True)
    (folder / "outputs.md").write_text(outputs_page(), encoding="utf-8")
    (folder / "features.md").write_text(features_page(), encoding="utf-8")
    (folder / "notices.md").write_text(notices_page(), encoding="utf-8")
    (folder / "files.md").write_text(files_page(), encoding="utf-8")
    (folder / "references.bib").write_text(bibliography(), encoding="utf-8")
    example_pages(folder)
    for name, page in api_pages().items():
        (folder / f"api_{name}.md").write_text(page, encoding="utf-8")
    with warnings.catch_warnings(), matplotlib.rc_context(STYLE):
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        for draw in (signs, frames, play, latching, peaks, horizon, verdicts, production):
            figure = Figure(figsize=(7.0, 6.4 if draw is verdicts else 3.4), layout="constrained")
            draw(figure)
            figure.savefig(folder / f"{draw.__name__}.png", dpi=150, metadata={"Software": None})


def crank(**changes: float) -> cc.Scene:
    """The mechanism of the figures."""
    given = {"crank_length": 0.05, "rod_length": 0.12, "clearance": 2e-5, "crank_speed": cc.rpm(2000)}
    return cc.mechanisms.slider_crank(**(given | changes))


def outputs_page() -> str:
    """Every output of a scene with all kinds of parts: name, unit."""
    from chebclear.scene.columns import column_unit

    scene = crank()
    facts = scene.check()
    rows = {}
    for name in (*facts.columns, *facts.further_columns, facts.sector_columns[0]):
        owner, _, kind = name.partition(".")
        kinds = {"slider": "BODY", "wrist": "CLEARANCE_JOINT", "guide": "JOINT", "drive": "DRIVE"}
        if owner in kinds:
            rows.setdefault(f"{kinds[owner]}.{kind}", column_unit(name))
        elif owner == "energy":
            rows.setdefault(name, column_unit(name))
    block = cc.Body("block", 1.0, 1.0)
    contact = cc.laws.Hertz(1e9)
    guide = cc.ClearancePrismatic("guide", "ground", "block", (1.0, 0.0), 0.1, 0.05, 1e-3, contact)
    for name in cc.Scene([block], [guide]).check().columns:
        owner, _, kind = name.partition(".")
        if owner == "guide":
            shown = kind.replace("front_left", "CORNER")
            if "left" not in shown and "right" not in shown:
                rows.setdefault(f"GUIDE.{shown}", column_unit(name))
    teeth = ("tooth_force", "tooth_force_x", "tooth_force_y", "transmission_error")
    for name in ("torque", "driver_torque", "force", "driver_force", *teeth):
        rows[f"COUPLING.{name}"] = column_unit(name)
    body = "\n".join(f"| `{name}` | {unit or '-'} |" for name, unit in rows.items())
    return f"| output | unit |\n|---|---|\n{body}\n"


def features_page() -> str:
    """Every feature with the first line of what it is."""
    names = "peak lowest peak_to_peak time_of_peak time_of_lowest mean rms".split()
    names += "impacts contact_share impulse wear loss least_transmission_angle".split()
    rows = [
        f"| `cc.features.{name}(...)` | {getattr(cc.features, name).__doc__.splitlines()[0]} |"
        for name in names
    ]
    return "| feature | what it is |\n|---|---|\n" + "\n".join(rows) + "\n"


def notices_page() -> str:
    """Every code of a notice with what it says."""
    rows = [f"| `{code}` | {meaning} |" for code, meaning in CODES.items()]
    return "| code | what it says |\n|---|---|\n" + "\n".join(rows) + "\n"


def bibliography() -> str:
    """The table of `REFERENCES.md` for BibTeX: authors, title, and the rest as it stands there."""
    table = (Path(__file__).parents[1] / "REFERENCES.md").read_text(encoding="utf-8")
    entries = []
    for key, who, told in re.findall(r"^\| (\w+) \| (.*?): (.*) \|$", table, re.MULTILINE):
        # A book is a title alone; that of an article ends with the sentence.
        ended = re.split(r"\. |(?<=\?) ", told, maxsplit=1)
        _, title, rest = told.split("*", 2) if told.startswith("*") else ("", *ended)
        fields = {"author": who.replace(", ", " and "), "title": f"{{{title}}}"}
        fields["howpublished"] = rest.replace("*", "").strip(" .,")
        fields["year"] = year = "".join(re.findall(r"\d{4}$", key))
        for before, after in ((f" ({year}) ", ": "), (f" ({year})", ""), (f" {year}", "")) if year else ():
            fields["howpublished"] = fields["howpublished"].replace(before, after, 1)
        inner = ", ".join(f"{name} = {{{value}}}" for name, value in fields.items() if value)
        entries.append(f"@misc{{{key}, {inner}}}")
    return "\n".join(entries)


GROUPS = {
    "Scenes": "Scene Body Revolute Prismatic Fixed ClearanceRevolute ClearancePrismatic PinInSlot Stop "
    "Spring Damper Bushing TorsionSpring TorsionDamper Force Torque Gravity JointStart BodyStart "
    "ClearanceStart GuideStart rpm",
    "Scene files": "load loads read_linkage",
    "Runs": "simulate Settings Trajectory load_result animate",
    "Studies": "Study Interval normal lognormal uniform triangular compare bifurcation "
    "restraint_zones require conformance rare_share stack_up contrast lost_motion modes "
    "load_measured identify",
    "Trade-offs": "tradeoff study_tradeoff allocate center",
    "Errors and warnings": "ChebclearError ChebclearWarning",
}
ROOMS = {
    "mechanisms": "Ready-made mechanisms",
    "motions": "Motions and functions of time",
    "laws": "Laws of contact and friction",
    "distributions": "Distributions of parameters",
    "features": "Features",
    "plots": "Pictures",
    "results": "Types of results",
    "errors": "All errors and warnings",
}


def api_pages() -> dict[str, str]:
    """The public names by groups: those of the package, then one page for each public module."""
    groups = {title: names.split() for title, names in GROUPS.items()}
    known = {name for names in groups.values() for name in names} | {*ROOMS, "__version__"}
    if rest := sorted(set(cc.__all__) ^ known):
        raise ValueError(f"the reference has no group for {rest}, or the package no such name")
    for room, title in ROOMS.items():
        groups[title] = [f"{room}.{name}" for name in getattr(cc, room).__all__ if name not in cc.__all__]
    pages = {}
    for number, (title, names) in enumerate(groups.items(), start=1):
        text = f"# {title}\n\n```{{eval-rst}}\n"
        for name in names:
            room, _, own = name.rpartition(".")
            public = getattr(cc, room) if room else cc
            kind = "class" if isinstance(getattr(public, own), type) else "function"
            text += f".. auto{kind}:: chebclear.{name}\n"
        pages[f"{number:02d}"] = f"{text}```\n"
    return pages


def signs(figure: Figure) -> None:
    """Journal and bearing with the vectors of the conventions."""
    ax = figure.add_subplot()
    ax.set_aspect("equal")
    ax.axis("off")
    bearing, journal, turn = np.zeros(2), 0.28, 0.6
    direction = np.array([np.cos(turn), np.sin(turn)])
    tangent = np.array([-direction[1], direction[0]])
    center = 0.36 * direction
    ax.add_patch(patches.Circle(bearing, 1.0, fill=False, color="black", linewidth=1.5))
    ax.add_patch(
        patches.Circle(center, 1.0 - journal, facecolor="tab:blue", alpha=0.25, edgecolor="tab:blue")
    )
    arrows = [
        (bearing, center, "black", "eccentricity $e$", (-0.35, -0.33)),
        (center, center + 0.85 * direction, "tab:red", "normal $n$", (0.06, 0.02)),
        (center, center + 0.6 * tangent, "tab:green", "tangent $t$", (-0.5, 0.05)),
    ]
    for start, tip, color, text, offset in arrows:
        ax.annotate("", tip, start, arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.6})
        ax.text(*(tip + np.array(offset)), text, color=color)
    force = center + (1.0 - journal) * direction
    ax.annotate(
        "",
        force - 0.5 * direction,
        force,
        arrowprops={"arrowstyle": "-|>", "color": "tab:purple", "linewidth": 2.2},
    )
    ax.text(1.15, 0.25, "normal force on the journal", color="tab:purple")
    ax.text(-2.6, 0.6, "bearing")
    ax.annotate("", (-0.93, 0.36), (-2.0, 0.6), arrowprops={"arrowstyle": "-", "color": "black"})
    ax.text(-2.6, -0.6, "journal", color="tab:blue")
    ax.annotate("", (-0.25, -0.28), (-2.0, -0.55), arrowprops={"arrowstyle": "-", "color": "tab:blue"})
    ax.set_xlim(-3.0, 3.4)
    ax.set_ylim(-1.15, 1.3)


def play(figure: Figure) -> None:
    """The journal in its clearance circle, and its penetration against time."""
    run = cc.simulate(crank(), duration=0.03, samples=3001)
    left, right = figure.subplots(1, 2, width_ratios=[1.4, 1.3])
    cc.plots.plot_orbit(run, "wrist", ax=left)
    right.plot(1e3 * run.t, 1e6 * run["wrist.penetration"], linewidth=0.8)
    right.axhline(0.0, color="black", linewidth=0.8)
    right.set(xlabel="time [ms]", ylabel="penetration [µm]", xlim=(0.0, 3.0))


def production(figure: Figure) -> None:
    """Densities from the same limits, and shares of dimensions with a common cause."""
    left, right = figure.subplots(1, 2)
    of = cc.distributions
    kinds = {
        "Cpk 1": of.capable(-1.0, 1.0, 1.0),
        "Cpk 0.5, inspected": of.inspected(of.capable(-1.0, 1.0, 0.5)),
        "shifted by 0.4": of.capable(-1.0, 1.0, 1.0, shift=0.4),
        "skewed": of.skewed(-1.0, -0.5, 1.0),
        "uniform": of.uniform(-1.0, 1.0),
    }
    values, step = np.linspace(-1.2, 1.2, 481), 1e-5
    for name, one in kinds.items():
        density = [(one.cdf(value + step) - one.cdf(value - step)) / (2.0 * step) for value in values]
        left.plot(values, density, label=name, linewidth=1.2)
    left.set(xlabel="dimension (limits at -1 and 1)", ylabel="density", ylim=(0.0, 2.4))
    left.legend(fontsize=7.0)
    part, one = np.linspace(0.0, 0.98, 99), of.normal(0.0, 1.0)
    for word, sign in (("sum", 1.0), ("difference", -1.0)):
        outside = [2e6 * one.cdf(-3.0 * np.sqrt(2.0) / np.sqrt(2.0 + 2.0 * sign * common)) for common in part]
        right.semilogy(part, outside, label=f"{word} of two")
    right.set(xlabel="part of the variance from a common cause", ylabel="ppm outside", ylim=(1e-2, 1e5))
    right.legend(fontsize=8.0)


def peaks(figure: Figure) -> None:
    """An impact between samples."""
    scene = crank()
    coarse = cc.simulate(scene, duration=0.03, samples=361, features=[cc.features.peak("wrist.normal_force")])
    fine = cc.simulate(scene, duration=0.03, samples=30_001)
    peak = coarse.peak("wrist.normal_force")
    shown = abs(fine.t - peak.time) < 2.5e-4
    ax = figure.add_subplot()
    ax.plot(1e3 * fine.t[shown], fine["wrist.normal_force"][shown], color="tab:gray", label="motion")
    near = abs(coarse.t - peak.time) < 2.5e-4
    ax.plot(1e3 * coarse.t[near], coarse["wrist.normal_force"][near], "o", color="tab:blue", label="samples")
    ax.plot(1e3 * peak.time, peak.value, "*", color="tab:red", markersize=12, label="run.peak")
    ax.set(xlabel="time [ms]", ylabel="normal force [N]")
    ax.legend()


def horizon(figure: Figure) -> None:
    """Two runs whose clearances differ by one part in a million."""
    runs = [
        cc.simulate(
            crank(clearance=clearance),
            duration=0.3,
            samples=6001,
            rtol=1e-9,
            outputs=["slider.vx", "wrist.normal_force"],
        )
        for clearance in (5e-4, 5e-4 * (1.0 + 1e-6))
    ]
    ax = figure.add_subplot()
    for name in runs[0]:
        difference = np.abs(runs[0][name] - runs[1][name]) / np.ptp(runs[0][name])
        ax.semilogy(1e3 * runs[0].t, np.maximum(np.maximum.accumulate(difference), 1e-9), label=name)
    ax.axhline(0.01, color="tab:red", linestyle="--", linewidth=0.9, label="1 % of the range")
    ax.set(xlabel="time [ms]", ylabel="largest difference so far / range")
    ax.legend()


def latching(figure: Figure) -> None:
    """The loops of force against penetration of two impacts, and the rates that they keep."""
    scene = cc.mechanisms.free_journal(clearance=2e-4, restitution=0.6)
    run = cc.simulate(scene, duration=0.04, samples=200_001)
    left, right = figure.subplots(1, 2)
    rate, force, depth = (
        run[f"bearing.{kind}"] for kind in ("penetration_rate", "normal_force", "penetration")
    )
    for number, color in ((0, "tab:blue"), (2, "tab:red")):
        start, end = run.contacts.onset[number], run.contacts.separation[number]
        inside = (run.t >= start) & (run.t <= end)
        kept = run.contacts.impact_velocity[number]
        label = f"impact {number + 1}, at {1e3 * kept:.1f} mm/s"
        left.plot(1e6 * depth[inside], force[inside], color=color, label=label)
        since = 1e6 * (run.t[inside] - start)
        right.plot(since, 1e3 * rate[inside], color=color)
        right.plot(0.0, 1e3 * kept, "o", color=color, clip_on=False)
    right.axhline(0.0, color="black", linewidth=0.8)
    left.set(xlabel="penetration [µm]", ylabel="normal force [N]", xlim=(0.0, None), ylim=(0.0, None))
    right.set(xlabel="time since the onset [µs]", ylabel="penetration rate [mm/s]", xlim=(0.0, None))
    left.legend(loc="upper left")


def verdicts(figure: Figure) -> None:
    """How sure bands may be, on one mechanism."""
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.02), "clearance": cc.Interval.around(2e-5, rel=0.5)},
        outputs=["slider.x", "wrist.normal_force"],
        duration=0.004,
        samples=201,
        skip=0.037,
    )
    force, band = "wrist.normal_force", study.band(41, coverage=0.99)
    shown = [
        band["slider.x"],
        band[force],
        study.band(60, coverage=0.95)[force],
        study.sample(20)[force],
        study.band(5)[force],
        study.chebyshev(4)[force],
    ]
    for ax, one in zip(figure.subplots(3, 2, sharex=True).flat, shown, strict=True):
        color = "tab:green" if one.resolved else "tab:red" if one.verdict == "unknown" else "tab:blue"
        ax.fill_between(1e3 * one.t, one.lower, one.upper, color=color, alpha=0.3, linewidth=0.0)
        for run in one.runs[:: max(1, len(one.runs) // 12)]:
            ax.plot(1e3 * one.t, run, color="0.4", linewidth=0.3)
        ax.set_title(f"{one.verdict}: {len(one.runs)} runs")
    for ax, label in zip(figure.axes, ["slider x [m]"] + ["force in wrist [N]"] * 5, strict=True):
        ax.set_ylabel(label)
    for ax in figure.axes[-2:]:
        ax.set_xlabel("time [ms]")


def frames(figure: Figure) -> None:
    """A body in ground: its frame, its points, its angle, and a torque."""
    ax = figure.add_subplot()
    ax.set_aspect("equal")
    ax.axis("off")
    turn, origin = 0.5, np.array([1.5, 0.45])
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]])
    tip, center = origin + 2.6 * along, origin + 1.1 * along + 0.12 * across

    def label(place: np.ndarray, right: float, up: float, text: str, color: str = "black") -> None:
        ax.text(place[0] + right, place[1] + up, text, color=color)

    def arrow(start: np.ndarray, end: np.ndarray, color: str, text: str, offset: tuple[float, float]) -> None:
        ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.5})
        label(end, *offset, text, color)

    ground = np.zeros(2)
    arrow(ground, np.array([1.0, 0.0]), "black", "x", (0.03, -0.05))
    arrow(ground, np.array([0.0, 1.0]), "black", "y", (-0.05, 0.05))
    ax.text(-0.1, -0.28, "ground", ha="left")
    outline = [origin - 0.25 * along, origin + 0.28 * across, tip + 0.2 * across, tip + 0.25 * along]
    outline += [tip - 0.2 * across, origin - 0.28 * across]
    ax.add_patch(patches.Polygon(outline, facecolor="tab:blue", alpha=0.18, edgecolor="tab:blue"))
    arrow(origin, origin + 0.8 * along, "tab:blue", "", (0.0, 0.0))
    arrow(origin, origin + 0.8 * across, "tab:blue", "frame of the body", (-0.65, 0.08))
    ax.plot(*origin, "o", color="tab:blue")
    label(origin, 0.1, -0.3, "point A = (0, 0)")
    ax.plot(*tip, "o", color="tab:blue")
    label(tip, 0.3, -0.12, "point B = (length, 0)")
    ax.plot(*center, marker="P", color="black", markersize=8)
    label(center, -0.75, 0.5, "center of mass")
    ax.plot([origin[0], origin[0] + 1.7], [origin[1]] * 2, color="0.5", linestyle="--", linewidth=0.9)
    ax.add_patch(patches.Arc(origin, 3.0, 3.0, theta1=0.0, theta2=np.degrees(turn), color="tab:red"))
    label(origin, 1.58, 0.22, "angle > 0", "tab:red")
    turned = {
        "arrowstyle": "-|>",
        "connectionstyle": "arc3,rad=0.55",
        "color": "tab:purple",
        "linewidth": 2.0,
    }
    ax.annotate("", tip + 0.45 * across - 0.1 * along, tip - 0.42 * across + 0.25 * along, arrowprops=turned)
    label(tip, 0.1, 0.62, "torque > 0", "tab:purple")
    ax.set_xlim(-0.4, 6.2)
    ax.set_ylim(-0.4, 2.8)


def front(figure: Figure) -> None:
    """The picture of the README: a mechanism, and the band of the force in its loose joint."""
    template = cc.load(Path(__file__).parents[1] / "examples" / "slider_crank.toml")
    result = template.study().band(runs=41)
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.5])
    run = cc.simulate(template(), duration=0.03, samples=301)
    cc.plots.plot_scene(run, 0.005, ax=left, exaggerate=200)
    left.set_title("slider-crank, play at the wrist (enlarged)")
    result["wrist.normal_force"].plot(ax=right)


if __name__ == "__main__":
    # The picture of the README is a file of the repository: a registry shows no other.
    warnings.simplefilter("ignore", cc.ChebclearWarning)
    with matplotlib.rc_context(STYLE):
        picture = Figure(figsize=(10.0, 3.6), layout="constrained")
        front(picture)
        picture.savefig(Path(__file__).parent / "front.png", dpi=110, metadata={"Software": None})
