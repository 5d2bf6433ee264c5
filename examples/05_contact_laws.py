"""Contact laws compared: the same mechanism with four laws for the force between journal and bearing.

Run it with ``python examples/05_contact_laws.py [DIRECTORY]``; pictures go there (default: here).
"""

import sys
from pathlib import Path

import chebclear as cc
import numpy as np
from matplotlib.figure import Figure

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# Steel on steel; a restitution of 0.7 loses half of the energy of an impact, here of 0.1 m/s.
CLEARANCE, RESTITUTION, SPEED = 1e-4, 0.7, 0.1
stiffness = cc.laws.hertz_stiffness(9.8e-3, CLEARANCE, 207e9, 0.3)
laws = {
    "Hertz (no loss)": cc.laws.Hertz(stiffness),
    "Hunt and Crossley": cc.laws.HuntCrossley(stiffness, hysteresis_factor=1.5 * (1.0 - RESTITUTION) / SPEED),
    "Lankarani and Nikravesh": cc.laws.LankaraniNikravesh(stiffness, RESTITUTION),
    "Flores": cc.laws.Flores(stiffness, RESTITUTION),
}
print(f"{'law':26s}{'changes':>9s}{'peak force':>12s}{'lost':>9s}{'in contact':>12s}")
runs = {}
for name, law in laws.items():
    scene = cc.mechanisms.slider_crank(contact=law, friction=None, clearance=CLEARANCE)
    turn = scene.period
    features = [
        cc.features.peak("wrist.normal_force"),
        cc.features.loss("wrist"),
        cc.features.contact_share("wrist"),
    ]
    run = cc.simulate(scene, duration=turn, samples=14401, skip=turn, features=features)
    runs[name] = run
    peak, lost, share = (run.feature(feature) for feature in features)
    print(f"{name:26s}{len(run.events):9d}{peak:10.0f} N{1e3 * lost:6.2f} mJ{100 * share:10.0f} %")

figure = Figure(figsize=(12, 8), layout="constrained")
axes = figure.subplots(2, 2)
cc.plots.plot_contacts(runs, ax=axes[0, 0])
for name in ("Hertz (no loss)", "Flores"):
    cc.plots.plot_trajectory(runs[name], "slider.ax", unit="km/s²", ax=axes[0, 1], label=name)
    cc.plots.plot_trajectory(runs[name], "wrist.normal_force", unit="kN", ax=axes[1, 1], label=name)
# Force over penetration around the hardest contact: without loss a curve, with loss a loop.
for name, run in runs.items():
    depth = 1e6 * run["wrist.penetration"]
    away = abs(run.t - run.peak("wrist.normal_force").time) > 1.5e-4
    depth[away | (depth <= 0.0)] = np.nan
    style = {"x": depth, "x_label": "penetration in wrist [µm]", "label": name}
    cc.plots.plot_trajectory(run, "wrist.normal_force", unit="kN", ax=axes[1, 0], **style)
figure.savefig(folder / "contact_laws.png")
