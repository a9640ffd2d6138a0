"""A rod with a clamped horizontal base that bends under its own weight, by peers in Python: error of the tip and run time.

    python3 -m venv target/peers
    target/peers/bin/pip install -r benches/peers/requirements.txt
    cargo bench -p morphorod-benches --bench peers -- --python target/peers/bin/python

The benchmark in Rust runs this program, which also runs on its own (`--out FILE`).

The table has a row for each peer and setting: error of the tip relative to the length, and the shortest of a few run times in
seconds, compilation and import not counted. Peers that are not installed are left out.

- SciPy, `solve_bvp`: collocation of fourth order on a mesh that adapts itself. Three dimensions: position, frame (a quaternion)
  and couple, ten unknown functions, in units in which the length and E I are 1. A straight first guess.
- PyElastica: a discrete Cosserat rod, which can stretch and shear, damped until it rests. Bending sits at its nodes, so that the
  clamp holds up to the middle of the first element; half an element more before the base makes up for that.
"""

import argparse
import os
import time
import warnings

# One thread, as for all peers; libraries read this when they are imported.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from scipy.integrate import solve_bvp

try:
    import elastica
except ImportError:
    elastica = None

# Length and radius, m; Young's modulus, Pa; density, kg/m³; gravity, m/s²; Poisson's ratio.
LENGTH, RADIUS, MODULUS, DENSITY, GRAVITY, POISSON = 0.0659, 5e-4, 1e7, 1000.0, 9.81, 0.5
LOAD = 4.0 * DENSITY * GRAVITY * LENGTH**3 / (MODULUS * RADIUS**2)
# Outwards, across, up, over the length; `tests/horizontal_base.rs` says how it is known.
TIP = np.array([0.05725356580615882, 0.0, -0.03042617632477989]) / LENGTH
# The frame that turns the vertical d3 outwards, scalar first.
CLAMP = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])


def tangent(w, x, y, z):
    """The third director of a frame."""
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


def rates(s, state):
    """Position, quaternion and couple along the rod: r' = d3, q' = ω q/2, m' = -d3 × n, with the weight beyond for n."""
    w, x, y, z, m1, m2, m3 = state[3:]
    t1, t2, t3 = tangent(w, x, y, z)
    # K⁻¹ m for equal bending stiffnesses: 1 across the tangent, E I/(G J) = 1 + ν along it.
    along = POISSON * (m1 * t1 + m2 * t2 + m3 * t3)
    a, b, c = m1 + along * t1, m2 + along * t2, m3 + along * t3
    n = -LOAD * (1.0 - s)
    return np.array([
        t1, t2, t3,
        0.5 * (-a * x - b * y - c * z), 0.5 * (a * w + b * z - c * y),
        0.5 * (b * w + c * x - a * z), 0.5 * (c * w + a * y - b * x),
        -t2 * n, t1 * n, np.zeros_like(s),
    ])


def ends(base, tip):
    """A clamp at the base, no couple at the tip."""
    return np.concatenate([base[:3], base[3:7] - CLAMP, tip[7:]])


def scipy_tip(nodes, tolerance):
    """The tip over the length, by `solve_bvp`, from a straight rod."""
    s = np.linspace(0.0, 1.0, nodes)
    guess = np.zeros((10, nodes))
    guess[0] = s
    guess[3:7] = CLAMP[:, None]
    guess[8] = 0.5 * LOAD * (1.0 - s) ** 2
    found = solve_bvp(rates, ends, s, guess, tol=tolerance, bc_tol=tolerance, max_nodes=20000)
    return found.y[:3, -1] if found.success else np.full(3, np.nan)


def elastica_tip(elements, seconds):
    """The tip over the length, by PyElastica, after so many seconds of damped motion from straight."""

    class Scene(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping):
        """What PyElastica calls a simulator."""

    scene = Scene()
    element = LENGTH / (elements - 0.5)
    rod = elastica.CosseratRod.straight_rod(
        elements, np.array([-0.5 * element, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]),
        elements * element, RADIUS, DENSITY,
        youngs_modulus=MODULUS, shear_modulus=MODULUS / (2.0 * (1.0 + POISSON)),
    )
    scene.append(rod)
    scene.constrain(rod).using(elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    scene.add_forcing_to(rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -GRAVITY]))
    # The fastest waves, s: stretching passes an element, or shearing turns it at √(G A/(ρ I)), about a radius in the same time.
    step = min(0.5 * element, RADIUS) / np.sqrt(MODULUS / DENSITY)
    # Twice the lowest frequency of a cantilever, 3.516 √(E I/(ρ A ℓ⁴)) (I/A = r²/4), damps that oscillation best.
    damping = 2.0 * 3.516 * np.sqrt(MODULUS * RADIUS**2 / (4.0 * DENSITY * LENGTH**4))
    scene.dampen(rod).using(elastica.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=step)
    scene.finalize()
    elastica.integrate(elastica.PositionVerlet(), scene, seconds, int(seconds / step), progress_bar=False)
    return rod.position_collection[:, -1] / LENGTH


def candidates(quick):
    """Peer, setting, function and number of runs."""
    for tolerance in (1e-3, 1e-6) if quick else (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        for nodes in (5, 10, 20, 40):
            setting = f"tol {tolerance:.0e} from {nodes} nodes"
            yield "SciPy solve_bvp", setting, lambda n=nodes, t=tolerance: scipy_tip(n, t), 5
    if elastica is not None:
        # Compiled by the first call, which is not timed.
        elastica_tip(4, 1e-3)
        for elements in (10,) if quick else (10, 20, 40, 80):
            # Twenty times the slowest of the damped motions' times, 1/20 s: e⁻²⁰ of the deflection is left.
            yield "PyElastica", f"{elements} elements at rest", lambda n=elements: elastica_tip(n, 1.0), 1


def main():
    parser = argparse.ArgumentParser(description="A rod at rest by peers in Python: error of the tip and run time.")
    parser.add_argument("--out", default="target/out/peers_python.csv", help="the table [default: %(default)s]")
    parser.add_argument("--quick", action="store_true", help="a few settings only")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")
    os.makedirs(os.path.dirname(os.path.abspath(options.out)), exist_ok=True)
    with open(options.out, "w", encoding="utf-8") as table:
        table.write("peer,setting,error,seconds\n")
        for peer, setting, solve, runs in candidates(options.quick):
            shortest, tip = np.inf, None
            for _ in range(runs):
                begin = time.perf_counter()
                tip = solve()
                shortest = min(shortest, time.perf_counter() - begin)
            error = np.linalg.norm(tip - TIP)
            print(f"{peer:16} {setting:30} error {error:.1e}  {1e3 * shortest:10.2f} ms", flush=True)
            table.write(f"{peer},{setting},{error:e},{shortest:e}\n")


if __name__ == "__main__":
    main()
