#!/usr/bin/env python3
"""Compare Drivescope's plant with the CommonRoad vehicle models (PyPI commonroad-vehicle-models 3.0.2).

Usage: tests/commonroad/compare.py [path of the drivescope binary]

Installs the package into a virtual environment of its own below the user's cache directory, gives both simulations
the same car (vehicle 2, BMW 320i) and the same inputs, prints a table in Markdown and ends with status 1 when a
difference from the multi-body model is outside its tolerance. The single-track model is printed beside it.
"""

import csv
import dataclasses
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

PACKAGE = "commonroad-vehicle-models==3.0.2"
ROOT = pathlib.Path(__file__).resolve().parents[2]
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "drivescope-commonroad"
G = 9.81
# CommonRoad has neither air drag nor rolling resistance, and its tyres answer without delay.
ALIKE = {"resistance": 0, "relaxation": 0.2}
# Drivescope's brakes answer with this lag, s; CommonRoad is given the same brake torque over time.
BRAKE_LAG = 0.08
SPEED = 80 / 3.6


def enter_environment():
    """Run again inside the virtual environment, made on the first run."""
    if pathlib.Path(sys.prefix).resolve() == CACHE.resolve():
        return
    python = CACHE / "bin" / "python"
    if not (CACHE / "done").exists():
        subprocess.run([sys.executable, "-m", "venv", str(CACHE)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", PACKAGE], check=True)
        (CACHE / "done").touch()
    os.execv(python, [str(python), *sys.argv])


def parameters():
    from types import SimpleNamespace

    from omegaconf import OmegaConf
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

    def plain(node):
        return SimpleNamespace(**{k: plain(v) if isinstance(v, dict) else v for k, v in node.items()})

    given = parameters_vehicle2()
    return plain(dataclasses.asdict(given) if dataclasses.is_dataclass(given) else OmegaConf.to_container(given))


def same_car(p):
    """The car in Drivescope's parameters.

    Drivescope's tyres are rigid in the vertical, so their springs stand in series with the suspension's.
    """
    series = lambda a, b: a * b / (a + b)
    roll = series(0.5 * p.T_f**2 * p.K_sf - p.K_tsf, 0.5 * p.T_f**2 * p.K_zt)
    roll += series(0.5 * p.T_r**2 * p.K_sr - p.K_tsr, 0.5 * p.T_r**2 * p.K_zt)
    pitch = 2 * (p.a**2 * series(p.K_sf, p.K_zt) + p.b**2 * series(p.K_sr, p.K_zt))
    return {
        "m": p.m, "m_s": p.m_s, "l_f": p.a, "l_r": p.b, "h": p.h_cg, "h_s": p.h_s - p.h_raf, "tw": 0.5 * (p.T_f + p.T_r),
        "I_z": p.I_z, "I_x": p.I_Phi_s + p.m_s * (p.h_s - p.h_raf) ** 2, "k_x": roll, "k_y": pitch,
        "K_f": -p.tire.p_ky1, "K_r": -p.tire.p_ky1, "mu": p.tire.p_dy1,
    }


def drivescope(binary, car, manoeuvre, alike):
    """Columns of the error-free truth of a manoeuvre that begins 30 m down a level road to the north."""
    spec = {
        "name": "compare", "description": "CommonRoad", "car": "bmw_320i", "sensors": "ideal", "car_changes": car,
        "start_speed_kmh": 80, "manoeuvre": {"at": 30, **manoeuvre},
        **(ALIKE if alike else {}), "segments": [{"length": 2000, "speed_kmh": 80}],
    }
    with tempfile.TemporaryDirectory() as folder:
        given, out = pathlib.Path(folder, "compare.json"), pathlib.Path(folder, "out.csv")
        given.write_text(json.dumps(spec))
        subprocess.run([*binary, "simulate", str(given), "--out", str(out)], check=True, cwd=ROOT)
        with out.open() as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = ["t", "truth_vx", "truth_vy", "truth_yaw_rate", "truth_roll", "truth_n"]
    columns = [[float(row[n]) for n in names] for row in rows if row.get("truth_vx")]
    start = next(i for i, c in enumerate(columns) if c[5] >= 30.0)
    t0 = columns[start][0]
    return [(c[0] - t0, c[1], c[2], c[3], c[4], c[5] - columns[start][5]) for c in columns[start:]]


def integrate(model, state, inputs, seconds, dt, view):
    """Classic Runge-Kutta; rows of time, vx, vy, yaw rate, roll, distance."""
    rows = []
    steps = round(seconds / dt)
    for k in range(steps + 1):
        t = k * dt
        if k % round(0.01 / dt) == 0:
            rows.append((t, *view(state)))
        if view(state)[0] < 0.5:
            break
        f = lambda x, at: model(list(x), inputs(at, x))
        k1 = f(state, t)
        k2 = f([x + 0.5 * dt * d for x, d in zip(state, k1)], t + 0.5 * dt)
        k3 = f([x + 0.5 * dt * d for x, d in zip(state, k2)], t + 0.5 * dt)
        k4 = f([x + dt * d for x, d in zip(state, k3)], t + dt)
        state = [x + dt / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4)]
        for wheel in range(23, min(27, len(state))):
            state[wheel] = max(state[wheel], 0.0)
    return rows


def commonroad(p, steer, acceleration, seconds):
    """Multi-body and single-track histories for a steering angle over time, right positive in the result."""
    from vehiclemodels.init_mb import init_mb
    from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
    from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

    h = 1e-4
    rate = lambda t: (steer(t + h) - steer(t - h)) / (2 * h)
    core = [0, 0, 0, SPEED, 0, 0, 0]
    # CommonRoad is z-up with left positive: mirrored, a steer to the right is a steer to the left.
    body = integrate(
        lambda x, u: vehicle_dynamics_mb(x, u, p), init_mb(core, p), lambda t, x: [rate(t), acceleration(t, x[3])],
        seconds, 5e-4, lambda x: (x[3], x[10], x[5], x[6], x[0]),
    )
    track = integrate(
        lambda x, u: vehicle_dynamics_st(x, u, p), core, lambda t, x: [rate(t), acceleration(t, x[3])],
        seconds, 1e-3, lambda x: (x[3] * math.cos(x[6]), x[3] * math.sin(x[6]), x[5], math.nan, x[0]),
    )
    return body, track


def lateral(rows):
    """Lateral acceleration over time."""
    return [
        (b[2] - a[2]) / (b[0] - a[0]) + 0.5 * (a[3] * a[1] + b[3] * b[1]) for a, b in zip(rows, rows[1:])
    ]


def step_measures(rows, until=4.5):
    rows = [r for r in rows if r[0] <= until]
    tail = [r for r in rows if r[0] > until - 1]
    steady = sum(r[3] for r in tail) / len(tail)
    crossed = lambda share: next(
        a[0] + (b[0] - a[0]) * (share * steady - a[3]) / (b[3] - a[3])
        for a, b in zip(rows, rows[1:]) if abs(b[3]) >= abs(share * steady)
    )
    gravity = sum(abs(r[3] * r[1]) for r in tail) / len(tail) / G
    roll = sum(abs(r[4]) for r in tail) / len(tail)
    return {
        "steady yaw rate, deg/s": abs(math.degrees(steady)),
        "rise time 10 to 90 %, s": crossed(0.9) - crossed(0.1),
        "roll per g, deg": math.degrees(roll) / gravity,
    }


def sine_measures(rows, until=4.0):
    rows = [r for r in rows if r[0] <= until]
    return {
        "peak yaw rate, deg/s": math.degrees(max(abs(r[3]) for r in rows)),
        "peak lateral acceleration, m/s^2": max(abs(a) for a in lateral(rows)),
    }


def braking_measures(rows):
    last = next((r for r in rows if r[1] < 0.5), rows[-1])
    return {"distance, m": last[5] + last[1] ** 2 / 10}


def sine_with_dwell(amplitude, frequency=0.7, dwell=0.5):
    def steer(t):
        peak = 0.75 / frequency
        running = t if t < peak else max(t - dwell, peak)
        return 0.0 if t < 0 or running * frequency >= 1 else amplitude * math.sin(2 * math.pi * frequency * running)
    return steer


def compare(title, shipped, alike, body, track, tolerances):
    """Print a row for each measure; whether all are inside their tolerances with what CommonRoad lacks left out."""
    good = True
    for name, tolerance in tolerances.items():
        difference, whole = alike[name] / body[name] - 1, shipped[name] / body[name] - 1
        inside = abs(difference) <= tolerance
        good &= inside
        single = "" if math.isnan(track[name]) else f"{track[name]:.3f}"
        print(f"| {title} | {name} | {body[name]:.3f} | {single} | {alike[name]:.3f} | {100 * difference:+.1f} % "
              f"| {100 * tolerance:.0f} % | {'yes' if inside else 'no'} | {shipped[name]:.3f} | {100 * whole:+.1f} % |")
    return good


def main():
    enter_environment()
    run = ["cargo", "run", "--release", "--quiet", "-p", "drivescope-cli", "--"]
    binary = [str(pathlib.Path(sys.argv[1]).resolve())] if len(sys.argv) > 1 else run
    p = parameters()
    car = same_car(p)
    good = True
    print("| manoeuvre | measure | multi-body | single-track | alike | difference | tolerance | inside | as shipped | difference |")
    print("|---|---|---:|---:|---:|---:|---:|---|---:|---:|")
    ours = lambda manoeuvre: [drivescope(binary, car, manoeuvre, alike) for alike in (False, True)]
    hold = lambda t, v: 3.0 * (SPEED - v)
    for degrees in (1.0, 2.0):
        steer = lambda t: math.radians(degrees) * min(max(t / 0.1, 0.0), 1.0)
        manoeuvre = {"kind": "step_steer", "steer_deg": degrees, "rise": 0.1, "duration": 5}
        results = [step_measures(rows) for rows in (*ours(manoeuvre), *commonroad(p, steer, hold, 5))]
        tolerances = {"steady yaw rate, deg/s": 0.05, "rise time 10 to 90 %, s": 0.15, "roll per g, deg": 0.10}
        good &= compare(f"step steer {degrees:.0f} deg, 80 km/h", *results, tolerances)
    for degrees in (1.5, 3.0):
        manoeuvre = {"kind": "sine_with_dwell", "steer_deg": degrees, "duration": 4.5}
        steer = sine_with_dwell(math.radians(degrees))
        results = [sine_measures(rows) for rows in (*ours(manoeuvre), *commonroad(p, steer, lambda t, v: 0.0, 4.5))]
        tolerances = {"peak yaw rate, deg/s": 0.10, "peak lateral acceleration, m/s^2": 0.10}
        good &= compare(f"sine with dwell {degrees:.1f} deg, 80 km/h", *results, tolerances)
    for braking in (4.0, 7.0):
        manoeuvre = {"kind": "braking", "deceleration": braking}
        built_up = lambda t, v: -braking * (1 - math.exp(-t / BRAKE_LAG))
        rows = (*ours(manoeuvre), *commonroad(p, lambda t: 0.0, built_up, 12))
        good &= compare(f"braking {braking:.0f} m/s^2 from 80 km/h", *map(braking_measures, rows), {"distance, m": 0.05})
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
