// stability, cycles, fits
use crate::*; use crate::cases1::*;
use morphorod::constitutive::*; use morphorod::cycle::*; use morphorod::fit::*; use morphorod::growth::*; use morphorod::integrator::*; use morphorod::load::*;
use morphorod::nalgebra::*; use morphorod::stability::*; use morphorod::tropism::*; use morphorod::*;
const NAN: f64 = f64::NAN; const INF: f64 = f64::INFINITY;
fn up(l: f64) -> Result<Shoot<DynLaws>, ParameterError> { Shoot::builder(Y).length(l).radius(5e-4).elements(4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(20.0))).load(Weight { density: 1000.0 }).into_dyn().build() }
fn lin(l: f64) -> Result<Linearisation, StabilityError> { Linearisation::about(&up(l)?) }
fn root() -> Result<Root, StabilityError> { lin(0.067)?.rightmost() }
fn cr(c: Crossing<1>) -> R { Ok(format!("crossing at {}", c.parameters[0])) }
fn orb(o: PeriodicOrbit) -> R { Ok(format!("period {} s, error {}", o.period, o.error)) }
fn wav(o: RotatingWave) -> R { Ok(format!("rate {} 1/s, radius {} m", o.rate, o.radius())) }
fn per(f: impl FnOnce(&mut PeriodicSolver)) -> R { let mut s = PeriodicSolver::default(); f(&mut s); orb(s.from_mode(&up(0.067)?, &root()?, 0.02)?) }
fn bs() -> BoundarySettings { BoundarySettings { start: [0.0656, 20.0], frequency: 1.2e-3, direction: [0.0, 1.0], low: [0.06, 10.0], high: [0.07, 30.0], step: 0.1, points: 3 } }
fn bo(s: BoundarySettings) -> R { let f = |l: f64, e: f64| { let s = Shoot::builder(Y).length(l).radius(5e-4).elements(4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(e))).load(Weight { density: 1000.0 }).into_dyn().build()?; Linearisation::about(&s) }; Ok(format!("{} points", boundary(f, &s)?.len())) }
fn fam(l: f64) -> Result<Shoot<DynLaws>, CycleError> { Ok(up(l)?) }
fn found() -> Result<Crossing<1>, StabilityError> { onset(lin, 0.065, 0.066) }
fn cont(c: Crossing<1>, a: f64, r: std::ops::RangeInclusive<f64>) -> R { let mut x = Continuation::from_onset(RotatingWaveSolver::default(), fam, &c, a, r)?; let q = x.next().transpose()?; Ok(format!("first point {:?}", q.map(|q| q.parameter))) }
type F = Family<fn(&[f64]) -> Result<Shoot<DynLaws>, ParameterError>>;
fn sh(v: &[f64]) -> Result<Shoot<DynLaws>, ParameterError> { Shoot::builder(Y).length(0.05).radius(5e-4).elements(2).growth(UniformGrowth { zone_length: 0.04, time: 72e3 }).tropism((g(v[0]), p(v[1]))).scene(Still::tilted(1.0)).into_dyn().build() }
fn family() -> F { Family { parameters: vec![Parameter::positive("beta", [0.1, 5.0]), Parameter::positive("eta", [2.0, 100.0])], build: sh } }
fn data(n: usize) -> (Vec<f64>, Vec<Vector3<f64>>) { let mut s = sh(&[0.8, 20.0]).unwrap(); let t: Vec<f64> = (1..=n).map(|k| 7200.0 * k as f64 / n as f64).collect(); let mut x = vec![]; let _ = MethodOfSteps::new(120.0).advance_showing(&mut s, 7200.0, t.clone(), |s| x.push(s.tip())).unwrap(); for (k, p) in x.iter_mut().enumerate() { *p += Vector3::new(1e-5 * (k as f64 * 12.9898).sin(), 1e-5 * (k as f64 * 78.233).sin(), 1e-5 * (k as f64 * 37.7).sin()); } (t, x) }
fn tips(n: usize) -> Series { let (t, x) = data(n); Series::tips(t, &x) }
fn run_fit(f: F, fit: Fit, d: Vec<Series>) -> R { let e = Fit { threads: 1, ..fit }.run(&f, &d)?; Ok(e.parameters.iter().map(|p| format!("{} = {} ± {} ({:?})", p.name, p.value, p.error, p.verdict)).collect::<Vec<_>>().join(", ")) }
fn fd(d: Vec<Series>) -> R { run_fit(family(), Fit::default(), d) }
fn fs(f: Fit) -> R { run_fit(family(), f, vec![tips(40)]) }
fn fp(ps: Vec<Parameter>) -> R { run_fit(Family { parameters: ps, build: sh }, Fit::default(), vec![tips(40)]) }
pub fn cases(v: &mut Vec<Case>) {
    m! { v;
    "linearisation of an elongating shoot that is tilted" => { let l = Linearisation::about(&b().into_dyn().build()?)?; Ok(format!("{} unstable", l.unstable()?)) };
    "linearisation of a shoot with an oscillator" => { let l = Linearisation::about(&Shoot::builder(Y).length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(20.0), Oscillator::new(0.2, 1440.0))).into_dyn().build()?)?; Ok(format!("{} unstable", l.unstable()?)) };
    "linearisation of a shoot without laws" => { let l = Linearisation::about(&Shoot::builder(Y).length(0.05).radius(5e-4).into_dyn().build()?)?; Ok(format!("{} unstable", l.unstable()?)) };
    "linearisation of a shoot that buckles" => { let l = Linearisation::about(&Shoot::builder(Y).length(0.3).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.4, time: 72e3 })).tropism((g(0.8), p(20.0))).load(Weight { density: 1000.0 }).into_dyn().build()?)?; Ok(format!("{} unstable", l.unstable()?)) };
    "linearisation without proprioception" => { let l = Linearisation::about(&Shoot::builder(Y).length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism(g(0.8)).into_dyn().build()?)?; Ok(format!("{} unstable, {:?}", l.unstable()?, l.rightmost()?.value)) };
    "steady state of a tilted shoot without proprioception" => { let mut s = Shoot::builder(Y).length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism(g(0.8)).scene(Still::tilted(1.0)).into_dyn().build()?; solve_steady_state(&mut s)?; Ok("steady".into()) };
    "steady state of an own law whose `steady` is not one" => { let mut s = Shoot::builder(Y).length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism(Dl { var: Variable::read_after(720.0), rate: |_, _| 1.0, sense: |_| 0.0 }).into_dyn().build()?; solve_steady_state(&mut s)?; Ok("steady".into()) };
    "linearisation of a law with a gradient NaN" => { let l = Linearisation::about(&Shoot::builder(Y).length(0.05).radius(5e-4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism(Tl(|_, _, _| Vector3::repeat(NAN), |_| INF)).into_dyn().build()?)?; Ok(format!("{} unstable", l.unstable()?)) };
    "linearisation refined into 0 parts" => { Linearisation::refined(&up(0.06)?, 0)?; Ok("made".into()) };
    "linearisation refined into 1e9 parts" => { Linearisation::refined(&up(0.06)?, 1_000_000_000)?; Ok("made".into()) };
    "linearisation resolved to tolerance 0" => { Linearisation::resolved(&up(0.06)?, 0.0)?; Ok("made".into()) };
    "linearisation resolved to tolerance 1e-300" => { Linearisation::resolved(&up(0.06)?, 1e-300)?; Ok("made".into()) };
    "linearisation resolved to tolerance NaN" => { Linearisation::resolved(&up(0.06)?, NAN)?; Ok("made".into()) };
    "roots right of NaN" => Ok(format!("{}", lin(0.06)?.roots(NAN)?.len()));
    "roots right of -1e9 1/s" => Ok(format!("{}", lin(0.06)?.roots(-1e9)?.len()));
    "response at frequency 0" => { lin(0.06)?.response(0.0, &Vector3::repeat(Complex::new(1.0, 0.0)))?; Ok("made".into()) };
    "response at frequency NaN" => { lin(0.06)?.response(NAN, &Vector3::x().map(|x: f64| Complex::new(x, 0.0)))?; Ok("made".into()) };
    "response to a twist" => { lin(0.06)?.response(1e-3, &Vector3::z().map(|x: f64| Complex::new(x, 0.0)))?; Ok("made".into()) };
    "onset in a range without one" => cr(onset(lin, 0.05, 0.055)?);
    "onset in an empty range" => cr(onset(lin, 0.05, 0.05)?);
    "onset from NaN" => cr(onset(lin, NAN, 0.055)?);
    "onset in cm" => cr(onset(lin, 6.5, 6.6)?);
    "onset to a length longer than the zone" => cr(onset(lin, 0.06, 0.08)?);
    "refined onset with tolerance 1e-300" => cr(Refinement::to(1e-300).onset(|l, _| lin(l), 0.065, 0.066)?);
    "refined onset with a family that ignores the number of elements" => cr(Refinement::to(1e-6).onset(|l, _| lin(l), 0.065, 0.066)?);
    "refined onset with first 0" => cr(Refinement { first: 0, ..Refinement::to(1e-6) }.onset(|l, _| lin(l), 0.065, 0.066)?);
    "refined onset with last below first" => cr(Refinement { first: 8, last: 4, ..Refinement::to(1e-6) }.onset(|l, _| lin(l), 0.065, 0.066)?);
    "boundary: start outside the rectangle" => bo(BoundarySettings { start: [1.0, 1.0], ..bs() });
    "boundary: start far from the curve" => bo(BoundarySettings { start: [0.061, 29.0], frequency: 1.0, ..bs() });
    "boundary: step 0" => bo(BoundarySettings { step: 0.0, ..bs() });
    "boundary: direction zero" => bo(BoundarySettings { direction: [0.0; 2], ..bs() });
    "boundary: rectangle reversed" => bo(BoundarySettings { low: [0.07, 30.0], high: [0.06, 10.0], ..bs() });
    "boundary: frequency NaN" => bo(BoundarySettings { frequency: NAN, ..bs() });
    "boundary: frequency in rad/min" => bo(BoundarySettings { frequency: 0.072, ..bs() });
    "periodic: intervals 0" => per(|s| s.intervals = 0);
    "periodic: stages 100" => per(|s| s.stages = 100);
    "periodic: tolerance 0" => per(|s| s.tolerance = 0.0);
    "periodic: tolerance 1e-300" => per(|s| { s.tolerance = 1e-300; s.intervals = 8; s.accuracy = 1.0 });
    "periodic: accuracy NaN" => per(|s| s.accuracy = NAN);
    "periodic: max_iterations 0" => per(|s| s.max_iterations = 0);
    "periodic: max_work 0" => per(|s| s.max_work = 0);
    "periodic: angle NaN" => per(|s| s.angle = Some(NAN));
    "periodic: amplitude NaN" => orb(PeriodicSolver::default().from_mode(&up(0.067)?, &root()?, NAN)?);
    "periodic: amplitude 20 (mm for m)" => orb(PeriodicSolver::default().from_mode(&up(0.067)?, &root()?, 20.0)?);
    "periodic: shoot that is stable" => orb(PeriodicSolver::default().from_mode(&up(0.055)?, &lin(0.055)?.rightmost()?, 0.01)?);
    "periodic: root of another mesh" => { let s = Shoot::builder(Y).length(0.067).radius(5e-4).elements(7).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(20.0))).load(Weight { density: 1000.0 }).into_dyn().build()?; orb(PeriodicSolver::default().from_mode(&s, &root()?, 0.02)?) };
    "periodic: from_run of a shoot never started" => orb(PeriodicSolver::default().from_run(&up(0.067)?, 5280.0)?);
    "periodic: from_run with period NaN" => orb(PeriodicSolver::default().from_run(&up(0.067)?, NAN)?);
    "periodic: from_run with a period of 88 (min)" => { let mut s = up(0.067)?; s.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0)); let _ = MethodOfSteps::new(120.0).advance(&mut s, 18e3)?; orb(PeriodicSolver::default().from_run(&s, 88.0)?) };
    "periodic: from_run with a period of 1e9 s" => { let mut s = up(0.067)?; s.set_intrinsic(|_| Vector3::new(3.0, 8.0, 0.0)); let _ = MethodOfSteps::new(120.0).advance(&mut s, 18e3)?; orb(PeriodicSolver::default().from_run(&s, 1e9)?) };
    "periodic: elongating shoot" => orb(PeriodicSolver::default().from_run(&b().into_dyn().build()?, 5280.0)?);
    "periodic: forced with a wrong period" => orb(PeriodicSolver::default().forced(&Shoot::builder(Y).length(0.05).radius(5e-4).elements(4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(20.0), Oscillator::new(0.2, 1440.0))).into_dyn().build()?, 1000.0)?);
    "periodic: forced with period -1" => orb(PeriodicSolver::default().forced(&up(0.05)?, -1.0)?);
    "periodic: forced with an angle" => orb(PeriodicSolver { angle: Some(0.0), ..PeriodicSolver::default() }.forced(&up(0.05)?, 1440.0)?);
    "wave: radius 0" => wav(RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, 0.0)?);
    "wave: radius NaN" => wav(RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, NAN)?);
    "wave: tolerance 0" => wav(RotatingWaveSolver { tolerance: 0.0, ..Default::default() }.from_mode(&up(0.067)?, &root()?, 0.02)?);
    "wave: max_iterations 0" => wav(RotatingWaveSolver { max_iterations: 0, ..Default::default() }.from_mode(&up(0.067)?, &root()?, 0.02)?);
    "wave: rate 0" => wav(RotatingWaveSolver::default().from_run(&up(0.067)?, 0.0)?);
    "wave: rate NaN" => wav(RotatingWaveSolver::default().from_run(&up(0.067)?, NAN)?);
    "wave: straight shoot" => wav(RotatingWaveSolver::default().from_run(&up(0.067)?, 1.2e-3)?);
    "wave: tilted shoot" => wav(RotatingWaveSolver::default().from_run(&Shoot::builder(Y).length(0.067).radius(5e-4).elements(4).growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72e3 })).tropism((g(0.8), p(20.0))).load((Weight { density: 1e3 }, Distributed(Vector3::x() * 1e-4))).into_dyn().build()?, 1.2e-3)?);
    "wave: multipliers of 10^6" => { let w = RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, 0.02)?; Ok(format!("{} roots", w.roots(&up(0.067)?, 1_000_000)?.roots.len())) };
    "wave: roots of another shoot" => { let w = RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, 0.02)?; Ok(format!("{} roots", w.roots(&up(0.05)?, 2)?.roots.len())) };
    "branch: amplitude NaN" => cont(found()?, NAN, 0.065..=0.066);
    "branch: amplitude 10 (mm)" => cont(found()?, 10.0, 0.065..=0.066);
    "branch: range reversed" => cont(found()?, 0.01, 0.066..=0.065);
    "branch: onset outside the range" => cont(found()?, 0.01, 0.05..=0.06);
    "branch: range NaN" => cont(found()?, 0.01, NAN..=0.066);
    "branch: longest step 0" => { Continuation::from_onset(RotatingWaveSolver::default(), fam, &found()?, 0.01, 0.065..=0.066)?.largest_step(0.0)?; Ok("set".into()) };
    "branch: from an orbit with step 0" => { let w = RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, 0.02)?; Continuation::from_orbit(RotatingWaveSolver::default(), fam, &w, 0.067, 0.0, 0.066..=0.068)?; Ok("begun".into()) };
    "branch: from an orbit at another parameter" => { let w = RotatingWaveSolver::default().from_mode(&up(0.067)?, &root()?, 0.02)?; Continuation::from_orbit(RotatingWaveSolver::default(), fam, &w, 0.05, 1e-4, 0.04..=0.068)?; Ok("begun".into()) };
    "fit: correct data" => fd(vec![tips(40)]);
    "fit: no data" => fd(vec![]);
    "fit: one frame" => fd(vec![tips(1)]);
    "fit: times not sorted" => { let (mut t, x) = data(10); t.swap(3, 4); fd(vec![Series::tips(t, &x)]) };
    "fit: NaN position" => { let (t, mut x) = data(10); x[4].x = NAN; fd(vec![Series::tips(t, &x)]) };
    "fit: constant column of positions" => { let (t, _) = data(10); fd(vec![Series::tips(t, &[Vector3::z() * 0.05; 10])]) };
    "fit: positions in mm" => { let (t, x) = data(10); fd(vec![Series::tips(t, &x.iter().map(|x| x * 1e3).collect::<Vec<_>>())]) };
    "fit: times in h" => { let (t, x) = data(40); fd(vec![Series::tips(t.iter().map(|t| t / 3600.0).collect(), &x)]) };
    "fit: times in ms" => { let (t, x) = data(40); fd(vec![Series::tips(t.iter().map(|t| t * 1e3).collect(), &x)]) };
    "fit: times negative" => { let (t, x) = data(10); fd(vec![Series::tips(t.iter().map(|t| t - 3600.0).collect(), &x)]) };
    "fit: different numbers" => { let (t, x) = data(10); fd(vec![Series::tips(t, &x[..8])]) };
    "fit: angles in degrees" => { let (t, _) = data(10); fd(vec![Series::angles(t, &[30.0, 31., 32., 33., 34., 35., 36., 37., 38., 39.], View::side())]) };
    "fit: noise 0" => fd(vec![tips(10).with_noise(0.0)]);
    "fit: noise 1e-300 m" => fd(vec![tips(10).with_noise(1e-300)]);
    "fit: noise 1 (mm for m)" => fd(vec![tips(10).with_noise(1.0)]);
    "fit: scale that the family does not have" => fd(vec![tips(10).with_scale("zoom")]);
    "fit: one offset for three coordinates" => fd(vec![tips(10).with_offset(&["x0"])]);
    "fit: view without rows" => { View::matrix(&[])?; Ok("made".into()) };
    "fit: view NaN" => { View::matrix(&[Vector3::repeat(NAN)])?; Ok("made".into()) };
    "fit: track of the tip in a view of one row" => { let (t, x) = data(10); fd(vec![Series::coordinates(t, &x.iter().map(|x| x.x).collect::<Vec<_>>(), View::side())]) };
    "fit: step 0" => fs(Fit { step: 0.0, ..Fit::default() });
    "fit: step 1e-9 s" => fs(Fit { step: 1e-9, ..Fit::default() });
    "fit: starts 0" => fs(Fit { starts: 0, ..Fit::default() });
    "fit: windows 25 (per cent)" => fs(Fit { windows: vec![25.0], ..Fit::default() });
    "fit: Huber threshold NaN" => fs(Fit { loss: Loss::Huber(NAN), ..Fit::default() });
    "fit: widest NaN" => fs(Fit { widest: NAN, ..Fit::default() });
    "fit: threads 0" => Ok(Fit { threads: 0, ..Fit::default() }.run(&family(), &[tips(40)]).map(|e| format!("χ² {}", e.chi_squared))?);
    "fit: no parameters" => fp(vec![]);
    "fit: parameter with reversed bounds" => fp(vec![Parameter::positive("beta", [5.0, 0.1]), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: parameter with a bound of 0" => fp(vec![Parameter::positive("beta", [0.0, 5.0]), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: parameter with bound NaN" => fp(vec![Parameter::positive("beta", [NAN, 5.0]), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: parameter start outside the bounds" => fp(vec![Parameter::positive("beta", [0.1, 5.0]).starting(9.0), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: parameter prior of width 0" => fp(vec![Parameter::positive("beta", [0.1, 5.0]).with_prior(1.0, 0.0), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: same name twice" => fp(vec![Parameter::positive("beta", [0.1, 5.0]), Parameter::positive("beta", [2.0, 100.0])]);
    "fit: parameter without effect" => fp(vec![Parameter::positive("beta", [0.1, 5.0]), Parameter::positive("eta", [2.0, 100.0]), Parameter::positive("none", [0.1, 1.0])]);
    "fit: bounds that exclude the truth" => fp(vec![Parameter::positive("beta", [3.0, 5.0]), Parameter::positive("eta", [2.0, 100.0])]);
    "fit: family that fails" => run_fit(Family { parameters: family().parameters, build: |_| Err(ParameterError::finite("x", NAN).unwrap_err()) }, Fit::default(), vec![tips(10)]);
    "fit: family that panics on an index" => run_fit(Family { parameters: vec![Parameter::positive("beta", [0.1, 5.0])], build: sh }, Fit::default(), vec![tips(10)]);
    "fit: scan of periods reversed" => { let f = family(); let t = Fit { threads: 1, ..Fit::default() }; let e = t.run(&f, &[tips(40)])?; t.scan_oscillator(|v, _| sh(v), &e, [3600.0, 600.0])?; Ok("scanned".into()) };
    "fit: scan of periods below the sampling" => { let f = family(); let t = Fit { threads: 1, ..Fit::default() }; let e = t.run(&f, &[tips(40)])?; t.scan_oscillator(|v, _| sh(v), &e, [10.0, 600.0])?; Ok("scanned".into()) };
    "fit: profile of an unknown parameter" => { let f = family(); let t = Fit { threads: 1, ..Fit::default() }; let e = t.run(&f, &[tips(40)])?; t.profile(sh, &e, "gamma")?; Ok("made".into()) };
    "fit: compare fits of different data" => { let f = family(); let t = Fit { threads: 1, ..Fit::default() }; let e = t.run(&f, &[tips(40)])?; Ok(format!("{}", e.compare(&t.run(&f, &[tips(30)])?)?)) };
    }
}
