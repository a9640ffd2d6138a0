// states, checkpoints, integrators, own solvers and integrators, equilibria, rods, ensembles, tracking, checks
use crate::*; use crate::cases1::*;
use morphorod::constitutive::*; use morphorod::equilibrium::*; use morphorod::growth::*; use morphorod::integrator::*; use morphorod::load::*;
use morphorod::nalgebra::*; use morphorod::rod::*; use morphorod::support::*; use morphorod::tracking::*; use morphorod::tropism::*; use morphorod::*;
use morphorod::ensemble::{self, Shard};
const NAN: f64 = f64::NAN; const INF: f64 = f64::INFINITY;
fn st() -> Shoot<DynLaws> { b().into_dyn().build().unwrap() }
fn ran() -> Shoot<DynLaws> { let mut s = st(); let _ = MethodOfSteps::new(120.0).advance(&mut s, 1200.0).unwrap(); s }
fn k(c: Statistics) -> R { Ok(format!("ran, {} steps", c.steps)) }
fn mos(step: f64, f: impl FnOnce(&mut MethodOfSteps)) -> R { let mut i = MethodOfSteps::new(step); f(&mut i); k(i.advance(&mut st(), 3600.0)?) }
/// An own solver that damages the result of Newton's method.
#[derive(Clone, Copy)] enum Bad { Half, Nothing, Lies, NanError, Soft, Intrinsic, Panic }
struct Own(Bad, NewtonSolver);
struct Softer<'a, C>(&'a C);
impl<C: Constitutive> Constitutive for Softer<'_, C> { fn respond(&self, t: &Tissue, u: &Vector3<f64>) -> ElasticResponse { let r = self.0.respond(t, u); ElasticResponse { energy: r.energy * 0.1, couple: r.couple * 0.1, tangent: r.tangent * 0.1 } } }
impl EquilibriumSolver for Own {
    fn equilibrate(&mut self, rod: &mut Rod, m: &impl Constitutive, f: &InternalForce) -> Result<Equilibrium, EquilibriumError> {
        match self.0 {
            Bad::Soft => self.1.equilibrate(rod, &Softer(m), f),
            Bad::Nothing => Ok(Equilibrium::default()),
            Bad::Half => { let mut e = self.1.equilibrate(rod, m, f)?; let fr: Vec<_> = rod.node_frames().iter().enumerate().map(|(i, q)| if i == 0 { *q } else { q * UnitQuaternion::new(Vector3::x() * 0.1 * i as f64 / 32.0) }).collect(); rod.set_shape(&fr, &[])?; e.error = 1e-9; Ok(e) }
            Bad::NanError => { let mut e = self.1.equilibrate(rod, m, f)?; e.error = NAN; e.energy = NAN; Ok(e) }
            Bad::Lies => { let mut e = self.1.equilibrate(rod, m, f)?; e.error = 0.5; Ok(e) }
            Bad::Intrinsic => { let e = self.1.equilibrate(rod, m, f)?; rod.set_intrinsic(|_| Vector3::x() * 5.0); Ok(e) }
            Bad::Panic => { let fr = vec![UnitQuaternion::new_unchecked(Quaternion::new(NAN, 0.0, 0.0, 0.0)); rod.nodes()]; rod.set_shape(&fr, &[])?; Ok(Equilibrium::default()) }
        }
    }
}
fn own(bad: Bad) -> R { let mut s = st(); let c = MethodOfSteps::with_solver(120.0, Own(bad, NewtonSolver::default())).advance(&mut s, 3600.0)?; Ok(format!("ran, tip {:?}, {} steps", s.tip().as_slice(), c.steps)) }
fn rod() -> Rod { Rod::uniform(0.05, 5e-4, Still::tilted(1.0).base, 8, Order::Eight).unwrap() }
fn eq(r: Result<Equilibrium, EquilibriumError>) -> R { Ok(format!("{}", r?)) }
fn solve(f: impl FnOnce(&mut NewtonSolver), load: Weight) -> R { let mut n = NewtonSolver::default(); f(&mut n); eq(n.solve(&mut rod(), &Y, &load, &Still::upright().environment(0.0))) }
fn parts(f: impl FnOnce(&mut TimeStep<DynLaws, NewtonSolver>) -> Result<(), IntegrationError>) -> R {
    let (mut s, mut n, mut t) = (ran(), NewtonSolver::default(), TimeStepper::default());
    let e = t.next_end(&s, 60.0, 3600.0)?; let mut x = t.begin(&mut s, &mut n, e)?; f(&mut x)?; k(x.finish()?)
}
fn tr(n: usize, f: impl Fn(f64) -> [f64; 2]) -> Result<Track, TrackingError> { let t: Vec<f64> = (0..n).map(|k| 120.0 * k as f64).collect(); let p = t.iter().map(|t| Vector2::from(f(*t))).collect(); Track::new(t, p) }
fn circ(t: f64) -> [f64; 2] { let a = t * std::f64::consts::TAU / 5400.0; [5e-3 * a.cos(), 5e-3 * a.sin()] }
fn nut(t: Track, band: [f64; 2]) -> R { let n = t.nutation(band)?; Ok(format!("nutates {}, period {:?} s", n.nutates, n.period)) }
pub fn cases(v: &mut Vec<Case>) {
    m! { v;
    "time step 0" => mos(0.0, |_| ());
    "time step -120" => mos(-120.0, |_| ());
    "time step NaN" => mos(NAN, |_| ());
    "time step infinite" => mos(INF, |_| ());
    "time step 1e-9 s" => mos(1e-9, |i| i.max_work = 10_000);
    "time step 1e6 s" => mos(1e6, |_| ());
    "time step 2 (min given for s) for an hour" => mos(2.0, |_| ());
    "integrator tolerance 0" => mos(120.0, |i| i.tolerance = 0.0);
    "integrator tolerance 1e-300, present feedback" => { let mut i = MethodOfSteps::new(1200.0); i.tolerance = 1e-300; k(i.advance(&mut st(), 3600.0)?) };
    "integrator tolerance 1" => mos(120.0, |i| i.tolerance = 1.0);
    "max_work 0" => mos(120.0, |i| i.max_work = 0);
    "max_corrections 0, long steps" => mos(1800.0, |i| i.max_corrections = 0);
    "solver tolerance 0" => mos(120.0, |i| i.solver.tolerance = 0.0);
    "solver tolerance 1e-300" => mos(120.0, |i| i.solver.tolerance = 1e-300);
    "solver tolerance NaN" => mos(120.0, |i| i.solver.tolerance = NAN);
    "solver max_iterations 0" => mos(120.0, |i| i.solver.max_iterations = 0);
    "solver max_iterations 0 with 40 retries" => mos(120.0, |i| { i.solver.max_iterations = 0; i.retries = 40 });
    "retries 1000 with a law that is NaN after 1000 s" => { let mut s = b().tropism(Tl(|a, _, _| Vector3::x() * if a.time > 1000.0 { NAN } else { 0.0 }, |_| INF)).into_dyn().build()?; let mut i = MethodOfSteps::new(120.0); i.retries = 1000; k(i.advance(&mut s, 3600.0)?) };
    "retries 1000 with a hold that leaves the reach" => { let mut s = b().support(Moving(|t: f64| Hold::apex().at(Vector3::z() * (0.045 + 1e-4 * t)))).into_dyn().build()?; let mut i = MethodOfSteps::new(120.0); i.retries = 1000; k(i.advance(&mut s, 3600.0)?) };
    "retries 60 with an elastic law that is NaN beyond a strain" => { let mut s = Shoot::builder(Cl(|t, u| { let k = stiff(t) * if u.norm() > 20.0 { NAN } else { 1.0 }; ElasticResponse { energy: 0.5 * u.dot(&(k * u)), couple: k * u, tangent: k } })).length(0.05).radius(5e-4).load(ApicalForce(|t: f64| Vector3::x() * 1e-7 * t)).into_dyn().build()?; let mut i = MethodOfSteps::new(120.0); i.retries = 60; k(i.advance(&mut s, 36000.0)?) };
    "advance to NaN" => k(MethodOfSteps::new(120.0).advance(&mut st(), NAN)?);
    "advance to infinity" => k(MethodOfSteps::new(120.0).advance(&mut st(), INF)?);
    "advance backwards" => k(MethodOfSteps::new(120.0).advance(&mut ran(), 600.0)?);
    "advance to -1" => k(MethodOfSteps::new(120.0).advance(&mut st(), -1.0)?);
    "advance to 1e15 s with max_work 10000" => { let mut i = MethodOfSteps::new(120.0); i.max_work = 10_000; k(i.advance(&mut st(), 1e15)?) };
    "output times not in order" => k(MethodOfSteps::new(120.0).advance_showing(&mut st(), 3600.0, [600.0, 300.0], |_| ())?);
    "output time after the end" => k(MethodOfSteps::new(120.0).advance_showing(&mut st(), 3600.0, [7200.0], |_| ())?);
    "output time NaN" => k(MethodOfSteps::new(120.0).advance_showing(&mut st(), 3600.0, [NAN], |_| ())?);
    "condition NaN" => k(MethodOfSteps::new(120.0).advance_until(&mut st(), 3600.0, |_| NAN)?);
    "condition never holds" => k(MethodOfSteps::new(120.0).advance_until(&mut st(), 3600.0, |s| s.tip().z - 1.0)?);
    "condition is minus infinity" => k(MethodOfSteps::new(120.0).advance_until(&mut st(), 3600.0, |_| -INF)?);
    "Adaptive tolerance 0" => ada(b().into_dyn(), 0.0, 3600.0);
    "Adaptive tolerance 1" => ada(b().into_dyn(), 1.0, 3600.0);
    "Adaptive tolerance NaN" => ada(b().into_dyn(), NAN, 3600.0);
    "Adaptive tolerance 1e-300" => ada(b().into_dyn(), 1e-300, 3600.0);
    "Adaptive max_work 0" => { let mut i = Adaptive::new(1e-4); i.max_work = 0; k(i.advance(&mut st(), 3600.0)?) };
    "Adaptive max_work 100" => { let mut i = Adaptive::new(1e-4); i.max_work = 100; k(i.advance(&mut st(), 3600.0)?) };
    "history NaN" => k(MethodOfSteps::new(120.0).start(&mut st(), &|_: f64, _: &Site, y: &mut [f64]| y.fill(NAN))?);
    "history of a wrong size (index 9)" => k(MethodOfSteps::new(120.0).start(&mut st(), &|_: f64, _: &Site, y: &mut [f64]| y[9] = 1.0)?);
    "intrinsic strain NaN, then advance" => { let mut s = st(); s.set_intrinsic(|_| Vector3::repeat(NAN)); k(MethodOfSteps::new(120.0).advance(&mut s, 600.0)?) };
    "intrinsic strain of 1e6 1/m (not slender)" => { let mut s = st(); s.set_intrinsic(|_| Vector3::x() * 1e6); k(MethodOfSteps::new(120.0).advance(&mut s, 600.0)?) };
    "intrinsic strain of 3000 1/m (radius 5e-4 m)" => { let mut s = st(); s.set_intrinsic(|_| Vector3::x() * 3000.0); k(MethodOfSteps::new(120.0).advance(&mut s, 600.0)?) };
    "restore a state of a shoot without tropism" => { let o = Shoot::builder(Y).length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.04, time: 72e3 }).into_dyn().build()?; let mut o = o; let _ = MethodOfSteps::new(120.0).advance(&mut o, 600.0)?; st().restore(o.state())?; Ok("restored".into()) };
    "restore a state of a shoot 1e9 times as long" => { let o = Shoot::builder(Y).length(5e7).radius(5e-4).into_dyn().build()?; st().restore(o.state())?; Ok("restored".into()) };
    "restore a state of a shoot with another growth zone" => { let mut o = b().growth(UniformGrowth { zone_length: 0.02, time: 72e3 }).into_dyn().build()?; let _ = MethodOfSteps::new(120.0).advance(&mut o, 600.0)?; let mut s = st(); s.restore(o.state())?; k(MethodOfSteps::new(120.0).advance(&mut s, 1200.0)?) };
    "checkpoint: empty bytes" => { let _: State = checkpoint::from_bytes(&[])?; Ok("read".into()) };
    "checkpoint: a text file" => { let _: State = checkpoint::from_bytes(b"time,x,y\n0,1,2\n")?; Ok("read".into()) };
    "checkpoint: truncated" => { let x = checkpoint::to_bytes(ran().state())?; let _: State = checkpoint::from_bytes(&x[..x.len() / 2])?; Ok("read".into()) };
    "checkpoint: only the header" => { let x = checkpoint::to_bytes(ran().state())?; let _: State = checkpoint::from_bytes(&x[..12])?; Ok("read".into()) };
    "checkpoint: one bit changed" => { let mut x = checkpoint::to_bytes(ran().state())?; let h = x.len() / 2; x[h] ^= 1; let _: State = checkpoint::from_bytes(&x)?; Ok("read".into()) };
    "checkpoint: another format" => { let mut x = checkpoint::to_bytes(ran().state())?; x[9] = 77; let _: State = checkpoint::from_bytes(&x)?; Ok("read".into()) };
    "checkpoint: read as another type" => { let x = checkpoint::to_bytes(&vec![1.0, 2.0])?; let _: State = checkpoint::from_bytes(&x)?; Ok("read".into()) };
    "with_model: Young's modulus NaN" => { let s = b().build()?; s.with_model(Laws { constitutive: LinearElastic { youngs_modulus: NAN, ..Y }, ..*s.model() })?; Ok("changed".into()) };
    "with_model: longer growth zone after growth" => { let mut s = b().build()?; let _ = MethodOfSteps::new(120.0).advance(&mut s, 7200.0)?; s.with_model(s.model().with_growth(UniformGrowth { zone_length: 0.05, time: 72e3 }))?; Ok("changed".into()) };
    "with_model: other number of variables" => { let mut s = b().build()?; let _ = MethodOfSteps::new(120.0).advance(&mut s, 7200.0)?; s.with_model(s.model().with_tropism(p(20.0)))?; Ok("changed".into()) };
    "with_model: longer delay than the history" => { let mut s = b().build()?; let _ = MethodOfSteps::new(120.0).advance(&mut s, 7200.0)?; let mut m = *s.model(); m.tropism.0.memory.delay = 7200.0; s.with_model(m)?; Ok("changed".into()) };
    "with_model: load outside" => { let s = b().build()?; s.with_model(s.model().with_load(PointForce { initial_apex_distance: 1.0, force: Vector3::x() }))?; Ok("changed".into()) };
    "with_model: Ongoing of a shoot that has outgrown the zone" => { let s = b().build()?; s.with_model(s.model().with_growth(Ongoing(UniformGrowth { zone_length: 0.04, time: 72e3 })))?; Ok("changed".into()) };
    "profile at 1 m" => Ok(format!("{:?}", ran().profile().at(1.0).map(|p| p.arc_length)));
    "profile at -1 m" => Ok(format!("{:?}", ran().profile().at(-1.0).map(|p| p.arc_length)));
    "profile at NaN" => Ok(format!("{:?}", ran().profile().at(NAN).map(|p| p.arc_length)));
    "profile sample of 0" => Ok(format!("{:?}", ran().profile().sample(0).len()));
    "profile of a shoot that was never started" => Ok(format!("couple at the base {:?}", st().profile().at(0.0).map(|p| p.couple.norm())));
    "own solver that halves the work: rotated frames" => own(Bad::Half);
    "own solver that does nothing and says so" => own(Bad::Nothing);
    "own solver that reports an error of 0.5 rad" => own(Bad::Lies);
    "own solver that reports NaN" => own(Bad::NanError);
    "own solver that exchanges the material" => own(Bad::Soft);
    "own solver that changes the intrinsic strain" => own(Bad::Intrinsic);
    "own solver that sets NaN frames" => own(Bad::Panic);
    "own solver without supports, shoot with a hold" => { let mut s = b().support(Hold::apex().at(Vector3::z() * 0.045)).into_dyn().build()?; k(MethodOfSteps::with_solver(120.0, Own(Bad::Lies, NewtonSolver::default())).advance(&mut s, 600.0)?) };
    "Unloaded on a shoot with weight" => k(MethodOfSteps::with_solver(120.0, Unloaded).advance(&mut st(), 600.0)?);
    "own step: finished at once" => parts(|_| Ok(()));
    "own step: no equilibrium" => parts(|x| { x.integrate_strain()?; Ok(()) });
    "own step: equilibrium before strain" => parts(|x| { let _ = x.equilibrate()?; Ok(()) });
    "own step: strain of a wrong number of points" => parts(|x| { x.set_strain(&[Vector3::zeros()])?; Ok(()) });
    "own step: strain NaN" => parts(|x| { let n = x.points().len(); x.set_strain(&vec![Vector3::repeat(NAN); n])?; let _ = x.equilibrate()?; Ok(()) });
    "own step: strain of 1e7 1/m" => parts(|x| { let n = x.points().len(); x.set_strain(&vec![Vector3::x() * 1e7; n])?; let _ = x.equilibrate()?; Ok(()) });
    "own step: rate of a point outside the zone" => parts(|x| { let _ = x.strain_rate(0, 1210.0)?; let _ = x.strain_rate(10_000, 1210.0)?; Ok(()) });
    "own step: rate at a time outside the step" => parts(|x| { let p = x.points().start; let _ = x.strain_rate(p, 0.0)?; Ok(()) });
    "own step: variables NaN" => parts(|x| { x.integrate_strain()?; let _ = x.equilibrate()?; x.sense()?; x.set_variables(|_, y| y.fill(NAN))?; Ok(()) });
    "own step: variables never set" => parts(|x| { x.integrate_strain()?; let _ = x.equilibrate()?; x.sense()?; Ok(()) });
    "own step: to the past" => { let (mut s, mut n, mut t) = (ran(), NewtonSolver::default(), TimeStepper::default()); let x = t.begin(&mut s, &mut n, 600.0)?; k(x.finish()?) };
    "own step: longest step 0" => { let s = ran(); Ok(format!("{}", TimeStepper::default().next_end(&s, 0.0, 3600.0)?)) };
    "own step: recorded grid of an empty run" => { let mut i = MethodOfSteps::new(120.0); i.follow(Grid::default()); k(i.advance(&mut st(), 600.0)?) };
    "rod of length NaN" => { Rod::uniform(NAN, 5e-4, UnitQuaternion::identity(), 8, Order::Eight)?; Ok("made".into()) };
    "rod of 0 elements" => { Rod::uniform(0.05, 5e-4, UnitQuaternion::identity(), 0, Order::Eight)?; Ok("made".into()) };
    "rod of radius 0" => { Rod::uniform(0.05, 0.0, UnitQuaternion::identity(), 8, Order::Eight)?; Ok("made".into()) };
    "rod with base NaN" => { Rod::uniform(0.05, 5e-4, Still::tilted(NAN).base, 8, Order::Eight)?; Ok("made".into()) };
    "rod with one node" => { Rod::straight(&[0.0], |_| 5e-4, UnitQuaternion::identity(), Order::Eight)?; Ok("made".into()) };
    "rod with nodes from 1 cm" => { Rod::straight(&[0.01, 0.02], |_| 5e-4, UnitQuaternion::identity(), Order::Eight)?; Ok("made".into()) };
    "rod: set_shape with two frames" => { rod().set_shape(&[UnitQuaternion::identity(); 2], &[])?; Ok("set".into()) };
    "rod: set_shape with a fold of π" => { let mut r = rod(); let mut f = r.node_frames(); let n = f.len(); f[n - 1] = f[n - 1] * UnitQuaternion::new(Vector3::x() * 3.14159); r.set_shape(&f, &[])?; Ok("set".into()) };
    "rod: set_base_position NaN" => { rod().set_base_position(Vector3::repeat(NAN))?; Ok("set".into()) };
    "equilibrium: tolerance 0" => solve(|n| n.tolerance = 0.0, Weight { density: 1e3 });
    "equilibrium: tolerance 1e-300" => solve(|n| n.tolerance = 1e-300, Weight { density: 1e3 });
    "equilibrium: max_iterations 0" => solve(|n| n.max_iterations = 0, Weight { density: 1e3 });
    "equilibrium: max_iterations 1" => solve(|n| n.max_iterations = 1, Weight { density: 1e3 });
    "equilibrium: density 1e9" => solve(|_| (), Weight { density: 1e9 });
    "equilibrium: density NaN" => solve(|_| (), Weight { density: NAN });
    "equilibrium: gravity NaN" => eq(NewtonSolver::default().solve(&mut rod(), &Y, &Weight { density: 1e3 }, &Environment { time: 0.0, gravity: Vector3::repeat(NAN) }));
    "equilibrium: modulus 0" => eq(NewtonSolver::default().solve(&mut rod(), &LinearElastic { youngs_modulus: 0.0, ..Y }, &Weight { density: 1e3 }, &Still::upright().environment(0.0)));
    "equilibrium: modulus negative" => eq(NewtonSolver::default().solve(&mut rod(), &LinearElastic { youngs_modulus: -1e7, ..Y }, &Weight { density: 1e3 }, &Still::upright().environment(0.0)));
    "equilibrium: force of another rod" => { let o = Rod::uniform(0.05, 5e-4, UnitQuaternion::identity(), 3, Order::Eight)?; let f = InternalForce::of(&o, &Weight { density: 1e3 }, &Still::upright().environment(0.0)); eq(NewtonSolver::default().equilibrate(&mut rod(), &Y, &f)) };
    "equilibrium: intrinsic strain NaN" => { let mut r = rod(); r.set_intrinsic(|_| Vector3::repeat(NAN)); eq(NewtonSolver::default().solve(&mut r, &Y, &(), &Still::upright().environment(0.0))) };
    "equilibrium: intrinsic strain 1e5 1/m on 8 elements" => { let mut r = rod(); r.set_intrinsic(|_| Vector3::x() * 1e5); eq(NewtonSolver::default().solve(&mut r, &Y, &Weight { density: 1e3 }, &Still::upright().environment(0.0))) };
    "equilibrium: Timoshenko under 1e3 N of compression" => { let mut r = Rod::uniform(0.05, 5e-4, UnitQuaternion::identity(), 8, Order::Eight)?; eq(NewtonSolver::default().solve(&mut r, &Timoshenko::circular(Y), &ApicalForce(|_: f64| Vector3::z() * -1e3), &Still::upright().environment(0.0))) };
    "ensemble of zero members" => Ok(format!("{:?}", ensemble::collect(0, 4, |i| i)));
    "ensemble on zero threads" => Ok(format!("{:?}", ensemble::collect(3, 0, |i| i)));
    "shard 0/4" => { Shard::new(0, 4)?; Ok("made".into()) };
    "shard 5/4" => { Shard::new(5, 4)?; Ok("made".into()) };
    "shard 1/0" => { Shard::new(1, 0)?; Ok("made".into()) };
    "shard from text a/b" => { "a/b".parse::<Shard>()?; Ok("made".into()) };
    "shard from text 3" => { "3".parse::<Shard>()?; Ok("made".into()) };
    "track empty" => nut(Track::new(vec![], vec![])?, [600.0, 7200.0]);
    "track with one position" => nut(tr(1, circ)?, [600.0, 7200.0]);
    "track of different lengths" => nut(Track::new(vec![0.0, 1.0], vec![Vector2::zeros()])?, [600.0, 7200.0]);
    "track with times backwards" => nut(Track::new(vec![0.0, 2.0, 1.0], vec![Vector2::zeros(); 3])?, [600.0, 7200.0]);
    "track with NaN position" => nut(tr(100, |t| if t > 600.0 { [NAN; 2] } else { [0.0; 2] })?, [600.0, 7200.0]);
    "track with infinite time" => nut(Track::new(vec![0.0, INF], vec![Vector2::zeros(); 2])?, [600.0, 7200.0]);
    "track constant" => nut(tr(720, |_| [0.0; 2])?, [600.0, 7200.0]);
    "track of 20 min for a band to 2 h" => nut(tr(10, circ)?, [600.0, 7200.0]);
    "track in min, band in s" => { let t = Track::new((0..720).map(|k| 2.0 * k as f64).collect(), (0..720).map(|k| Vector2::from(circ(120.0 * k as f64))).collect())?; nut(t, [1200.0, 7200.0]) };
    "track: band reversed" => nut(tr(720, circ)?, [7200.0, 600.0]);
    "track: band NaN" => nut(tr(720, circ)?, [NAN, 7200.0]);
    "track: band with a period below the sampling" => nut(tr(720, circ)?, [1.0, 7200.0]);
    "track: band from 0" => nut(tr(720, circ)?, [0.0, 7200.0]);
    "track: seen along a zero axis" => { Track::seen_along(&Vector3::zeros(), vec![0.0], &[Vector3::zeros()])?; Ok("made".into()) };
    "track: seen along a NaN axis" => { Track::seen_along(&Vector3::repeat(NAN), vec![0.0], &[Vector3::zeros()])?; Ok("made".into()) };
    "track: moving average of 0" => { tr(720, circ)?.moving_average(0)?; Ok("made".into()) };
    "track: moving average of 1000 of 720" => { tr(720, circ)?.moving_average(1000)?; Ok("made".into()) };
    "track: windows longer than the track" => Ok(format!("{}", tr(720, circ)?.windows(1e6, 1e3)?.count()));
    "track: windows every 0 s" => Ok(format!("{}", tr(720, circ)?.windows(1e4, 0.0)?.count()));
    "track: drift of a negative period" => { tr(720, circ)?.drift(-1.0)?; Ok("made".into()) };
    "track: drift of a period longer than the track" => { tr(720, circ)?.drift(1e6)?; Ok("made".into()) };
    "track: direction of one position" => { tr(1, circ)?.direction()?; Ok("made".into()) };
    "oscillations of 5 positions" => Ok(format!("{}", tr(5, circ)?.oscillations(&Search::default())?.oscillations.len()));
    "oscillations: least turns 0" => Ok(format!("{}", tr(200, circ)?.oscillations(&Search { least_turns: 0.0, ..Search::default() })?.oscillations.len()));
    "oscillations: least turns NaN" => Ok(format!("{}", tr(200, circ)?.oscillations(&Search { least_turns: NAN, ..Search::default() })?.oscillations.len()));
    "oscillations: drift of degree 1000" => Ok(format!("{}", tr(200, circ)?.oscillations(&Search { drift: 1000, ..Search::default() })?.oscillations.len()));
    "share at a period of 0" => Ok(format!("{}", tr(200, circ)?.share(0.0, &Search::default())?));
    "share at a period of NaN" => Ok(format!("{}", tr(200, circ)?.share(NAN, &Search::default())?));
    "check: couple of the wrong sign" => { check::elastic_law(&Cl(|t, u| { let k = stiff(t); ElasticResponse { energy: 0.5 * u.dot(&(k * u)), couple: -k * u, tangent: k } }), &Tissue::young(5e-4), &[(Vector3::new(1.0, 2.0, 3.0), Vector3::zeros())])?; Ok("agrees".into()) };
    "check: NaN strain" => { check::elastic_law(&Y, &Tissue::young(5e-4), &[(Vector3::repeat(NAN), Vector3::zeros())])?; Ok("agrees".into()) };
    "check: growth law with NaN" => { check::growth_law(&gl(|_, _| NAN, 0.04), &[(0.01, 0.0)], 1e3)?; Ok("agrees".into()) };
    "check: growth law with a negative distance" => { check::growth_law(&UniformGrowth { zone_length: 0.04, time: 72e3 }, &[(-0.01, 0.0)], 1e3)?; Ok("agrees".into()) };
    "check: no points" => { check::elastic_law(&Y, &Tissue::young(5e-4), &[])?; Ok("agrees".into()) };
    "check: shoot with an own law that is NaN" => { b().tropism(Tl(|_, _, _| Vector3::repeat(NAN), |_| INF)).into_dyn().build()?.check_laws()?; Ok("agrees".into()) };
    }
}
