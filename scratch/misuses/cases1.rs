// builders, laws, scenes, loads, supports
use crate::*;
use morphorod::constitutive::*; use morphorod::growth::*; use morphorod::integrator::*; use morphorod::load::*;
use morphorod::nalgebra::*; use morphorod::support::*; use morphorod::tropism::*; use morphorod::*;
pub const Y: LinearElastic = LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 };
pub const MEM: Memory = Memory { time: 720.0, delay: 720.0 };
pub fn g(b: f64) -> Remembered<Gravitropism<SettledStatoliths>> { Gravitropism { sensitivity: b, perception: SettledStatoliths }.remembered(MEM) }
pub fn p(e: f64) -> Remembered<Proprioception> { Proprioception { sensitivity: e }.remembered(MEM) }
pub type B = ShootBuilder<Laws<LinearElastic, UniformGrowth, (Remembered<Gravitropism<SettledStatoliths>>, Remembered<Proprioception>), Weight, Still>>;
/// A growing shoot, 5 cm.
pub fn b() -> B {
    Shoot::builder(Y).length(0.05).radius(5e-4).growth(UniformGrowth { zone_length: 0.04, time: 72e3 })
        .tropism((g(0.8), p(20.0))).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5))
}
pub fn built(b: ShootBuilder<DynLaws>) -> R { let s = b.build()?; Ok(format!("built, length {} m", s.rod().length())) }
pub fn run(b: ShootBuilder<DynLaws>) -> R { go(b, MethodOfSteps::new(120.0), 3600.0) }
pub fn go(b: ShootBuilder<DynLaws>, mut i: MethodOfSteps, t: f64) -> R {
    let mut s = b.build()?; let c = i.advance(&mut s, t)?;
    Ok(format!("ran to {} s, tip {:?}, {} steps", s.time(), s.tip().as_slice(), c.steps))
}
pub fn ada(b: ShootBuilder<DynLaws>, tol: f64, t: f64) -> R {
    let mut s = b.build()?; let c = Adaptive::new(tol).advance(&mut s, t)?;
    Ok(format!("ran to {} s, tip {:?}, error {:?}", s.time(), s.tip().as_slice(), c.error))
}
macro_rules! m { ($v:expr; $($name:expr => $f:expr;)*) => { $( $v.push(($name, Box::new(move || $f) as Box<dyn FnOnce() -> R + Send>)); )* } }
pub(crate) use m;
const NAN: f64 = f64::NAN; const INF: f64 = f64::INFINITY;

/// A growth law by function.
pub struct Gl { pub r: fn(f64, f64) -> f64, pub z: f64, pub v: Option<fn(f64, f64) -> f64>, pub next: fn(f64) -> f64 }
impl GrowthLaw for Gl {
    fn regr(&self, s: f64, t: f64) -> f64 { (self.r)(s, t) }
    fn zone_length(&self) -> f64 { self.z }
    fn apical_speed(&self, s: f64, t: f64) -> f64 { match self.v { Some(v) => v(s, t), None => { let z = s.min(self.z); let n = 64; (0..n).map(|k| (self.r)(z * (k as f64 + 0.5) / n as f64, t) * z / n as f64).sum() } } }
    fn next_discontinuity(&self, t: f64) -> f64 { (self.next)(t) }
}
pub fn gl(r: fn(f64, f64) -> f64, z: f64) -> Gl { Gl { r, z, v: None, next: |_| INF } }
/// A tropism by function.
pub struct Tl(pub fn(&Growing, &[f64], &[f64]) -> Vector3<f64>, pub fn(f64) -> f64);
impl TropismLaw for Tl {
    fn gradient(&self, at: &Growing, past: &[f64], now: &[f64]) -> Vector3<f64> { (self.0)(at, past, now) }
    fn next_discontinuity(&self, t: f64) -> f64 { (self.1)(t) }
}
pub struct Dl { pub var: Variable, pub rate: fn(&[f64], &[f64]) -> f64, pub sense: fn(&Site) -> f64 }
impl TropismLaw for Dl {
    fn declare(&self, to: &mut Declaration) { to.stimuli(1); to.variable(self.var); }
    fn sense(&self, site: &Site, x: &mut [f64]) { x[0] = (self.sense)(site); }
    fn rates(&self, y: &[f64], x: &[f64], r: &mut [f64]) { r[0] = (self.rate)(y, x); }
    fn gradient(&self, _a: &Growing, past: &[f64], _n: &[f64]) -> Vector3<f64> { Vector3::x() * past[0] }
}
pub struct Sc(pub fn(f64) -> Vector3<f64>, pub fn(f64) -> UnitQuaternion<f64>, pub fn(f64) -> f64);
impl Scene for Sc {
    fn gravity(&self, t: f64) -> Vector3<f64> { (self.0)(t) } fn base(&self, t: f64) -> UnitQuaternion<f64> { (self.1)(t) }
    fn next_discontinuity(&self, t: f64) -> f64 { (self.2)(t) }
}
pub fn down(_: f64) -> Vector3<f64> { Vector3::z() * -9.81 }
pub fn upr(_: f64) -> UnitQuaternion<f64> { UnitQuaternion::identity() }
pub struct Cl(pub fn(&Tissue, &Vector3<f64>) -> ElasticResponse);
impl Constitutive for Cl { fn respond(&self, t: &Tissue, u: &Vector3<f64>) -> ElasticResponse { (self.0)(t, u) } }
pub fn stiff(t: &Tissue) -> Matrix3<f64> { Matrix3::from_diagonal(&Y.stiffness(t.section)) }
pub struct Ll(pub fn(&Cut, &Environment) -> Vector3<f64>, pub Vec<f64>, pub fn(f64) -> f64);
impl Load for Ll {
    fn force(&self, c: &Cut, e: &Environment) -> Vector3<f64> { (self.0)(c, e) } fn jumps(&self) -> Vec<f64> { self.1.clone() }
    fn next_discontinuity(&self, t: f64) -> f64 { (self.2)(t) }
}
pub struct Ob(pub fn(&Vector3<f64>, f64) -> Distance);
impl Obstacle for Ob { fn distance(&self, x: &Vector3<f64>, t: f64) -> Distance { (self.0)(x, t) } }
pub struct Po(pub fn(&Vector3<f64>, f64) -> Energy);
impl Potential for Po { fn energy(&self, x: &Vector3<f64>, t: f64) -> Energy { (self.0)(x, t) } }
fn pole(x: f64, radius: f64) -> Cylinder { Cylinder { through: Vector3::x() * x, along: Vector3::y(), radius } }
fn touch<O>(obstacle: O, friction: f64) -> Contact<O> { Contact { obstacle, radius: 5e-4, friction } }

pub fn cases(v: &mut Vec<Case>) {
    m! { v;
    "length NaN" => built(b().length(NAN).into_dyn());
    "length 0" => built(b().length(0.0).into_dyn());
    "length -0.05 m" => built(b().length(-0.05).into_dyn());
    "length infinite" => built(b().length(INF).into_dyn());
    "length 50 (mm given for m), radius 5e-4" => run(b().length(50.0).into_dyn());
    "length and radius in mm: 50 and 0.5, zone 40" => run(b().length(50.0).radius(0.5).growth(UniformGrowth { zone_length: 40.0, time: 72e3 }).into_dyn());
    "length 1e300 m" => built(b().length(1e300).into_dyn());
    "length 1e-300 m" => built(b().length(1e-300).into_dyn());
    "no length" => built(Shoot::builder(Y).radius(5e-4).into_dyn());
    "no radius" => built(Shoot::builder(Y).length(0.05).into_dyn());
    "radius NaN" => built(b().radius(NAN).into_dyn());
    "radius 0" => built(b().radius(0.0).into_dyn());
    "radius 0.5 (mm given for m)" => built(b().radius(0.5).into_dyn());
    "radius negative" => built(b().radius(-5e-4).into_dyn());
    "radius 1e-200 m" => run(b().radius(1e-200).into_dyn());
    "section becomes negative at 4 cm" => built(b().section(|s| 5e-4 * (1.0 - s / 0.04)).into_dyn());
    "section NaN beyond 3 cm" => built(b().section(|s| if s > 0.03 { NAN } else { 5e-4 }).into_dyn());
    "section with a jump by a factor ten inside an element" => built(b().section(|s| if s > 0.031 { 5e-5 } else { 5e-4 }).into_dyn());
    "section ellipse with one zero axis" => built(b().section(|_| Section::ellipse(5e-4, 0.0)).into_dyn());
    "elements 0" => built(b().elements(0).into_dyn());
    "elements 1e9" => built(b().elements(1_000_000_000).into_dyn());
    "nodes not increasing" => built(b().nodes(&[0.0, 0.03, 0.02, 0.05]).into_dyn());
    "nodes that end before the length" => built(b().nodes(&[0.0, 0.02, 0.04]).into_dyn());
    "nodes in mm" => built(b().nodes(&[0.0, 20.0, 50.0]).into_dyn());
    "nodes empty" => built(b().nodes(&[]).into_dyn());
    "nodes with NaN" => built(b().nodes(&[0.0, NAN, 0.05]).into_dyn());
    "merge tolerance NaN" => built(b().merge_tolerance(NAN).into_dyn());
    "merge tolerance -1" => built(b().merge_tolerance(-1.0).into_dyn());
    "Young's modulus 0" => built(Shoot::builder(LinearElastic { youngs_modulus: 0.0, poissons_ratio: 0.5 }).length(0.05).radius(5e-4).into_dyn());
    "Young's modulus 10 (MPa given for Pa)" => run(Shoot::builder(LinearElastic { youngs_modulus: 10.0, poissons_ratio: 0.5 }).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "Young's modulus 1e-300" => run(Shoot::builder(LinearElastic { youngs_modulus: 1e-300, poissons_ratio: 0.5 }).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "Poisson's ratio 50 (per cent)" => built(Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 50.0 }).length(0.05).radius(5e-4).into_dyn());
    "Poisson's ratio -1" => built(Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: -1.0 }).length(0.05).radius(5e-4).into_dyn());
    "Lignifying time 0" => built(Shoot::builder(Lignifying { young: Y, mature_modulus: 1e8, time: 0.0 }).length(0.05).radius(5e-4).into_dyn());
    "Graded factor NaN near the apex" => built(Shoot::builder(Graded { law: Y, factor: |t: &Tissue| if t.initial_apex_distance < 0.01 { NAN } else { 1.0 } }).length(0.05).radius(5e-4).into_dyn());
    "Graded factor negative near the base" => built(Shoot::builder(Graded { law: Y, factor: |t: &Tissue| 0.03 - t.initial_apex_distance }).length(0.05).radius(5e-4).into_dyn());
    "Timoshenko shear modulus 0" => built(Shoot::builder(Timoshenko { shear_modulus: 0.0, ..Timoshenko::circular(Y) }).length(0.05).radius(5e-4).into_dyn());
    "own elastic law, tangent NaN" => built(Shoot::builder(Cl(|_, u| ElasticResponse { energy: 0.0, couple: *u, tangent: Matrix3::repeat(NAN) })).length(0.05).radius(5e-4).into_dyn());
    "own elastic law, couple of the wrong sign" => run(Shoot::builder(Cl(|t, u| { let k = stiff(t); ElasticResponse { energy: 0.5 * u.dot(&(k * u)), couple: -k * u, tangent: k } })).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "own elastic law, energy forgotten (zero)" => run(Shoot::builder(Cl(|t, u| { let k = stiff(t); ElasticResponse { energy: 0.0, couple: k * u, tangent: k } })).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "own elastic law, NaN beyond a strain of 2 1/m" => run(Shoot::builder(Cl(|t, u| { let k = stiff(t) * if u.norm() > 2.0 { NAN } else { 1.0 }; ElasticResponse { energy: 0.5 * u.dot(&(k * u)), couple: k * u, tangent: k } })).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "own elastic law, couple zero of a prestrained rod (couple at zero strain not zero)" => run(Shoot::builder(Cl(|t, u| { let k = stiff(t); let w = u - Vector3::x() * 10.0; ElasticResponse { energy: 0.5 * w.dot(&(k * w)), couple: k * w, tangent: k } })).length(0.05).radius(5e-4).load(Weight { density: 1000.0 }).scene(Still::tilted(0.5)).into_dyn());
    "tropism without growth" => built(Shoot::builder(Y).length(0.05).radius(5e-4).tropism(g(0.8)).into_dyn());
    "growth time 0" => built(b().growth(UniformGrowth { zone_length: 0.04, time: 0.0 }).into_dyn());
    "growth time 20 (h given for s)" => run(b().growth(UniformGrowth { zone_length: 0.04, time: 20.0 }).into_dyn());
    "growth time 1e-9 s" => run(b().growth(UniformGrowth { zone_length: 0.04, time: 1e-9 }).into_dyn());
    "growth zone NaN" => built(b().growth(UniformGrowth { zone_length: NAN, time: 72e3 }).into_dyn());
    "growth zone 40 (mm given for m)" => run(b().growth(UniformGrowth { zone_length: 40.0, time: 72e3 }).into_dyn());
    "growth zone 1e-9 m" => run(b().growth(UniformGrowth { zone_length: 1e-9, time: 72e3 }).into_dyn());
    "Ongoing on a shoot longer than its zone" => built(b().growth(Ongoing(UniformGrowth { zone_length: 0.04, time: 72e3 })).into_dyn());
    "CosineProfile with negative time" => built(b().growth(CosineProfile { zone_length: 0.04, time: -1.0 }).into_dyn());
    "LinearProfile with infinite zone" => built(b().growth(LinearProfile { zone_length: INF, time: 72e3 }).into_dyn());
    "own growth, speed twice the integral of the REGR" => run(b().growth(Gl { v: Some(|s, _| 2.0 * s.min(0.04) / 72e3), ..gl(|_, _| 1.0 / 72e3, 0.04) }).into_dyn());
    "own growth, REGR NaN from the start" => run(b().growth(gl(|_, _| NAN, 0.04)).into_dyn());
    "own growth, REGR NaN after 1000 s" => run(b().growth(gl(|_, t| if t > 1000.0 { NAN } else { 1.0 / 72e3 }, 0.04)).into_dyn());
    "own growth, REGR infinite at 1 cm" => run(b().growth(gl(|s, _| 1.0 / (s - 0.01).abs().max(0.0) / 72e5, 0.04)).into_dyn());
    "own growth, negative REGR (shrinking)" => run(b().growth(gl(|_, _| -1.0 / 720.0, 0.04)).into_dyn());
    "own growth, zone length zero" => built(b().growth(gl(|_, _| 1.0 / 72e3, 0.0)).into_dyn());
    "own growth, zone length negative" => built(b().growth(gl(|_, _| 1.0 / 72e3, -0.04)).into_dyn());
    "own growth, announced discontinuities in the past" => run(b().growth(Gl { next: |t| t - 1.0, ..gl(|_, _| 1.0 / 72e3, 0.04) }).into_dyn());
    "own growth, announced discontinuities NaN" => run(b().growth(Gl { next: |_| NAN, ..gl(|_, _| 1.0 / 72e3, 0.04) }).into_dyn());
    "own growth, discontinuities every 1e-6 s" => run(b().growth(Gl { next: |t| t + 1e-6, ..gl(|_, _| 1.0 / 72e3, 0.04) }).into_dyn());
    "own growth, step in the REGR that is not announced" => run(b().growth(gl(|_, t| if t > 1000.0 { 0.0 } else { 1.0 / 7e3 }, 0.04)).into_dyn());
    "own growth, step in the REGR not announced, Adaptive" => ada(b().growth(gl(|_, t| if t > 1000.0 { 0.0 } else { 1.0 / 7e3 }, 0.04)).into_dyn(), 1e-8, 3600.0);
    "own growth 1000 times too fast" => run(b().growth(gl(|_, _| 1.0 / 72.0, 0.04)).into_dyn());
    "memory time 0" => built(b().tropism(Proprioception { sensitivity: 1.0 }.remembered(Memory { time: 0.0, delay: 720.0 })).into_dyn());
    "memory delay negative" => built(b().tropism(Proprioception { sensitivity: 1.0 }.remembered(Memory { time: 720.0, delay: -720.0 })).into_dyn());
    "memory delay NaN" => built(b().tropism(Proprioception { sensitivity: 1.0 }.remembered(Memory { time: 720.0, delay: NAN })).into_dyn());
    "memory time and delay 12 (min given for s)" => run(b().tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time: 12.0, delay: 12.0 })).into_dyn());
    "delay 1e-12 s" => run(b().tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time: 720.0, delay: 1e-12 })).into_dyn());
    "delay 1e300 s" => run(b().tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time: 720.0, delay: 1e300 })).into_dyn());
    "memory time 1e-300 s" => run(b().tropism(Proprioception { sensitivity: 20.0 }.remembered(Memory { time: 1e-300, delay: 720.0 })).into_dyn());
    "gravitropic sensitivity NaN" => built(b().tropism(g(NAN)).into_dyn());
    "gravitropic sensitivity 1e10" => run(b().tropism(g(1e10)).into_dyn());
    "gravitropic sensitivity negative" => run(b().tropism(g(-0.8)).into_dyn());
    "proprioceptive sensitivity -20 (sign changed), 40 h" => go(b().tropism(p(-20.0)).into_dyn(), MethodOfSteps::new(120.0), 144e3);
    "proprioceptive sensitivity 1e4" => go(b().tropism(p(1e4)).into_dyn(), MethodOfSteps::new(120.0), 36e3);
    "oscillator period 0" => built(b().tropism(Oscillator::new(0.2, 0.0)).into_dyn());
    "oscillator period 24 (min given for s)" => run(b().tropism(Oscillator::new(0.2, 24.0)).into_dyn());
    "oscillator period 1e-6 s" => run(b().tropism(Oscillator::new(0.2, 1e-6)).into_dyn());
    "oscillator phase infinite" => built(b().tropism(Oscillator { phase: INF, ..Oscillator::new(0.2, 1440.0) }).into_dyn());
    "statoliths avalanche time -120 s" => built(b().tropism(Gravitropism { sensitivity: 0.8, perception: Statoliths { avalanche_time: -120.0 } }.remembered(MEM)).into_dyn());
    "own tropism, gradient NaN" => run(b().tropism(Tl(|_, _, _| Vector3::repeat(NAN), |_| INF)).into_dyn());
    "own tropism, gradient NaN after 1000 s" => run(b().tropism(Tl(|a, _, _| Vector3::x() * if a.time > 1000.0 { NAN } else { 0.0 }, |_| INF)).into_dyn());
    "own tropism, gradient infinite near the apex" => run(b().tropism(Tl(|a, _, _| Vector3::x() / (a.apex_distance - a.apex_distance), |_| INF)).into_dyn());
    "own tropism, gradient per second instead of per growth (1e6 1/m)" => run(b().tropism(Tl(|_, _, _| Vector3::x() * 1e6, |_| INF)).into_dyn());
    "own tropism, twist of 1e5 1/m" => run(b().tropism(Tl(|_, _, _| Vector3::z() * 1e5, |_| INF)).into_dyn());
    "own tropism, next discontinuity is always the present" => run(b().tropism(Tl(|_, _, _| Vector3::zeros(), |t| t)).into_dyn());
    "own tropism reads a variable that it did not declare" => run(b().tropism(Tl(|_, y, _| Vector3::x() * y[3], |_| INF)).into_dyn());
    "own variable with rate NaN" => run(b().tropism(Dl { var: Variable::read_after(720.0), rate: |_, _| NAN, sense: |_| 0.0 }).into_dyn());
    "own variable that explodes (y' = y² + 1e-3)" => run(b().tropism(Dl { var: Variable::read_after(0.0), rate: |y, _| y[0] * y[0] + 1e-3, sense: |_| 0.0 }).into_dyn());
    "own variable, declared as memory but not relaxing" => run(b().tropism(Dl { var: Variable::read_after(720.0).relaxing_in(720.0), rate: |_, _| 1.0, sense: |_| 0.0 }).into_dyn());
    "own variable, stiff rate without time constant (1e9 1/s)" => run(b().tropism(Dl { var: Variable::read_after(720.0), rate: |y, x| 1e9 * (x[0] - y[0]), sense: |s| s.strain.x }).into_dyn());
    "own variable with time constant 0" => run(b().tropism(Dl { var: Variable::read_after(720.0).relaxing_in(0.0), rate: |_, _| 0.0, sense: |_| 0.0 }).into_dyn());
    "own stimulus NaN" => run(b().tropism(Dl { var: Variable::read_after(720.0), rate: |y, x| x[0] - y[0], sense: |_| NAN }).into_dyn());
    "own stimulus reads the position without with_position" => run(b().tropism(Dl { var: Variable::read_after(720.0), rate: |y, x| 1e-3 * (x[0] - y[0]), sense: |s| s.position.x }).into_dyn());
    "own stimulus NaN for sites beyond 4 cm" => run(b().tropism(Dl { var: Variable::read_after(720.0), rate: |y, x| 1e-3 * (x[0] - y[0]), sense: |s| if s.arc_length > 0.04 { NAN } else { 0.0 } }).into_dyn());
    "density NaN" => built(b().load(Weight { density: NAN }).into_dyn());
    "density negative" => built(b().load(Weight { density: -1000.0 }).into_dyn());
    "density 1 (g/cm³ given for kg/m³)" => run(b().load(Weight { density: 1.0 }).into_dyn());
    "density 1e12" => run(b().load(Weight { density: 1e12 }).into_dyn());
    "density 1e300" => run(b().load(Weight { density: 1e300 }).into_dyn());
    "density function NaN near the base" => built(b().load(GradedWeight(|t: &Tissue| if t.initial_apex_distance > 0.04 { NAN } else { 1e3 })).into_dyn());
    "point force beyond the base (mm for m)" => built(b().load(PointForce { initial_apex_distance: 10.0, force: Vector3::x() * 1e-5 }).into_dyn());
    "point force at a negative distance" => built(b().load(PointForce { initial_apex_distance: -0.01, force: Vector3::x() * 1e-5 }).into_dyn());
    "point force of 5 N (mN meant)" => run(b().load(PointForce { initial_apex_distance: 0.0, force: Vector3::x() * 5.0 }).into_dyn());
    "point force of 1e6 N downwards" => run(b().load(PointForce { initial_apex_distance: 0.0, force: Vector3::z() * -1e6 }).into_dyn());
    "pull of 1e6 N at the tip, Timoshenko" => run(Shoot::builder(Timoshenko::circular(Y)).length(0.05).radius(5e-4).load(PointForce { initial_apex_distance: 0.0, force: Vector3::z() * -1e6 }).scene(Still::tilted(0.5)).into_dyn());
    "apical force NaN at t = 0" => built(b().load(ApicalForce(|_: f64| Vector3::repeat(NAN))).into_dyn());
    "apical force NaN after 1000 s" => run(b().load(ApicalForce(|t: f64| Vector3::x() * if t > 1000.0 { NAN } else { 0.0 })).into_dyn());
    "apical force that grows as exp(t)" => run(b().load(ApicalForce(|t: f64| Vector3::x() * 1e-9 * t.exp())).into_dyn());
    "own load infinite at the base" => run(b().load(Ll(|c, _| Vector3::z() * -1e-6 / c.arc_length, vec![], |_| INF)).into_dyn());
    "own load, force in the wrong place (not zero beyond the apex)" => run(b().load(Ll(|_, _| Vector3::z() * 1e-6, vec![], |_| INF)).into_dyn());
    "own load jumps at NaN" => built(b().load(Ll(|_, _| Vector3::zeros(), vec![NAN], |_| INF)).into_dyn());
    "own load jumps outside the shoot" => built(b().load(Ll(|_, _| Vector3::zeros(), vec![0.2], |_| INF)).into_dyn());
    "pulse of duration 0" => built(b().load(Pulse { peak: Vector3::x(), start: 0.0, duration: 0.0 }).into_dyn());
    "whirl with a negative period" => built(b().load(Whirl { force: 1e-5, period: -1.0, turns: 3.0 }).into_dyn());
    "distributed load NaN" => built(b().load(Distributed(Vector3::new(NAN, 0.0, 0.0))).into_dyn());
    "Still::tilted(NaN)" => built(b().scene(Still::tilted(NAN)).into_dyn());
    "Still::tilted(45) (degrees)" => run(b().scene(Still::tilted(45.0)).into_dyn());
    "Still with gravity infinite" => built(b().scene(Still { gravity: Vector3::z() * -INF, ..Still::upright() }).into_dyn());
    "Still with gravity NaN" => built(b().scene(Still { gravity: Vector3::repeat(NAN), ..Still::upright() }).into_dyn());
    "Still with base quaternion not of norm 1" => built(b().scene(Still { base: UnitQuaternion::new_unchecked(Quaternion::new(2.0, 0.0, 0.0, 0.0)), ..Still::upright() }).into_dyn());
    "Turned::tilted(NaN, 0, 1)" => built(b().scene(Turned::tilted(NAN, 0.0, 1.0)).into_dyn());
    "Turned with until before from" => built(b().scene(Turned::tilted(0.5, 3600.0, 0.0)).into_dyn());
    "Turned from NaN" => built(b().scene(Turned::tilted(0.5, NAN, 3600.0)).into_dyn());
    "Along a path that is NaN at t = 0" => built(b().scene(Along { scene: Still::upright(), path: |_: f64| Vector3::repeat(NAN) }).into_dyn());
    "Along a path that is NaN after 1000 s" => run(b().scene(Along { scene: Still::upright(), path: |t: f64| Vector3::x() * if t > 1000.0 { NAN } else { 0.0 } }).into_dyn());
    "own scene, base NaN after 1000 s" => run(b().scene(Sc(down, |t| Still::tilted(if t > 1000.0 { NAN } else { 0.0 }).base, |_| INF)).into_dyn());
    "own scene, base NaN from the start" => run(b().scene(Sc(down, |_| Still::tilted(NAN).base, |_| INF)).into_dyn());
    "own scene, gravity NaN after 1000 s" => run(b().scene(Sc(|t| Vector3::z() * if t > 1000.0 { NAN } else { -9.81 }, upr, |_| INF)).into_dyn());
    "own scene, clinostat with 1 rev/s" => run(b().scene(Sc(down, |t| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 6.28 * t), |_| INF)).into_dyn());
    "own scene, next discontinuity before the present" => run(b().scene(Sc(down, upr, |t| t - 5.0)).into_dyn());
    "hold at a NaN position" => built(b().support(Hold::apex().at(Vector3::repeat(NAN))).into_dyn());
    "hold of a place beyond the base" => built(b().support(Hold::place(0.5).at(Vector3::zeros())).into_dyn());
    "hold of the apex 10 m away" => run(b().support(Hold::apex().at(Vector3::x() * 10.0)).into_dyn());
    "hold of the apex at a distance of 5.1 cm (shoot of 5 cm)" => run(b().support(Hold::apex().at(Vector3::z() * 0.051)).into_dyn());
    "two contradictory holds of the apex" => run(b().support((Hold::apex().at(Vector3::z() * 0.04), Hold::apex().at(Vector3::x() * 0.04))).into_dyn());
    "the same hold twice" => run(b().support((Hold::apex().at(Vector3::z() * 0.045), Hold::apex().at(Vector3::z() * 0.045))).into_dyn());
    "hold of the clamped base" => run(b().support(Hold::place(0.05).at(Vector3::zeros())).into_dyn());
    "hold on a line with direction not of norm 1" => built(b().support(Hold::apex().on_line(Vector3::zeros(), Unit::new_unchecked(Vector3::x() * 3.0))).into_dyn());
    "hold frame NaN" => built(b().support(Hold::apex().held(Still::tilted(NAN).base)).into_dyn());
    "spring with negative stiffness" => built(b().support(Hold::apex().spring(Vector3::zeros(), -Matrix3::identity())).into_dyn());
    "spring with asymmetric stiffness" => built(b().support(Hold::apex().spring(Vector3::zeros(), Matrix3::new(1., 2., 0., 0., 1., 0., 0., 0., 1.))).into_dyn());
    "spring of stiffness 1e30 N/m" => run(b().support(Hold::apex().spring(Vector3::z() * 0.045, Matrix3::identity() * 1e30)).into_dyn());
    "elastic joint of negative stiffness" => built(b().support(Hold::apex().elastic_joint(UnitQuaternion::identity(), -1.0)).into_dyn());
    "moving hold that becomes NaN after 1000 s" => run(b().support(Moving(|t: f64| Hold::apex().on_plane(Vector3::z() * if t > 1000.0 { NAN } else { 0.03 }, Vector3::z_axis()))).into_dyn());
    "moving hold that jumps by 3 cm" => run(b().support(Moving(|t: f64| Hold::apex().on_plane(Vector3::z() * if t > 1000.0 { 0.01 } else { 0.04 }, Vector3::z_axis()))).into_dyn());
    "moving hold that leaves the reach of the shoot" => run(b().support(Moving(|t: f64| Hold::apex().at(Vector3::z() * (0.045 + 1e-4 * t)))).into_dyn());
    "base free without any hold" => run(b().support(Joint::Free).into_dyn());
    "ball joint at the base without any hold" => run(b().support(Joint::Ball).into_dyn());
    "hinge with a zero axis" => built(b().support(Joint::Hinge(Unit::new_unchecked(Vector3::zeros()))).into_dyn());
    "two base joints" => run(b().support((Joint::Ball, Joint::Free, Hold::apex().at(Vector3::z() * 0.045))).into_dyn());
    "friction negative" => built(b().support(touch(pole(0.01, 1e-3), -0.3)).into_dyn());
    "friction NaN" => built(b().support(touch(pole(0.01, 1e-3), NAN)).into_dyn());
    "contact radius 0.5 (mm for m)" => run(b().support(Contact { obstacle: pole(0.01, 1e-3), radius: 0.5, friction: 0.0 }).into_dyn());
    "obstacle radius 0" => built(b().support(touch(pole(0.01, 0.0), 0.0)).into_dyn());
    "obstacle contains the base" => run(b().support(touch(pole(0.0, 5e-3), 0.0)).into_dyn());
    "obstacle contains the whole shoot" => run(b().support(touch(Sphere { centre: Vector3::zeros(), radius: 1.0 }, 0.0)).into_dyn());
    "half space that contains all of the shoot but the base" => run(b().support(touch(HalfSpace { through: Vector3::z() * 1e-3, normal: -Vector3::z() }, 0.0)).into_dyn());
    "two obstacles that squeeze the shoot" => run(b().support((touch(HalfSpace { through: Vector3::x() * 2e-4, normal: -Vector3::x() }, 0.0), touch(HalfSpace { through: Vector3::x() * -2e-4, normal: Vector3::x() }, 0.0))).into_dyn());
    "half space with zero normal" => built(b().support(touch(HalfSpace { through: Vector3::zeros(), normal: Vector3::zeros() }, 0.0)).into_dyn());
    "capsule of zero length" => built(b().support(touch(Capsule { ends: [Vector3::x(); 2], radius: 1e-3 }, 0.0)).into_dyn());
    "cuboid with a contact radius of zero" => built(b().support(Contact { obstacle: Cuboid { centre: Vector3::x() * 0.02, frame: UnitQuaternion::identity(), half_edges: Vector3::repeat(1e-3) }, radius: 0.0, friction: 0.0 }).into_dyn());
    "cuboid with a negative edge" => built(b().support(touch(Cuboid { centre: Vector3::x() * 0.02, frame: UnitQuaternion::identity(), half_edges: Vector3::new(1e-3, -1e-3, 1e-3) }, 0.0)).into_dyn());
    "polyhedron without half spaces" => { ConvexPolyhedron::new(vec![])?; Ok("made".into()) };
    "polyhedron that is empty" => { ConvexPolyhedron::new(vec![HalfSpace { through: Vector3::x(), normal: -Vector3::x() }, HalfSpace { through: -Vector3::x(), normal: Vector3::x() }])?; Ok("made".into()) };
    "own obstacle, distance NaN" => run(b().support(touch(Ob(|_, _| Distance { value: NAN, normal: Vector3::x(), curvature: Matrix3::zeros() }), 0.0)).into_dyn());
    "own obstacle, distance NaN inside" => run(b().support(touch(Ob(|x, _| Distance { value: if x.x < 0.01 { 0.01 - x.x } else { NAN }, normal: -Vector3::x(), curvature: Matrix3::zeros() }), 0.0)).into_dyn());
    "own obstacle, normal towards the inside" => run(b().support(touch(Ob(|x, _| Distance { value: 0.01 - x.x, normal: Vector3::x(), curvature: Matrix3::zeros() }), 0.0)).into_dyn());
    "own obstacle, normal of length 2" => run(b().support(touch(Ob(|x, _| Distance { value: 0.01 - x.x, normal: -2.0 * Vector3::x(), curvature: Matrix3::zeros() }), 0.0)).into_dyn());
    "own obstacle, distance squared instead of distance" => run(b().support(touch(Ob(|x, _| { let d = x - Vector3::x() * 0.012; Distance { value: d.norm_squared() - 1e-6, normal: d.normalize(), curvature: Matrix3::zeros() } }), 0.0)).into_dyn());
    "own obstacle, wrong curvature of a sphere" => run(b().support(touch(Ob(|x, _| { let d = x - Vector3::new(0.013, 0.0, 0.03); Distance { value: d.norm() - 2e-3, normal: d.normalize(), curvature: Matrix3::identity() * -1e4 } }), 0.3)).into_dyn());
    "own obstacle that appears at 1000 s inside the shoot" => run(b().support(touch(Ob(|x, t| Distance { value: if t < 1000.0 { 1.0 } else { 0.01 - x.x }, normal: -Vector3::x(), curvature: Matrix3::zeros() }), 0.0)).into_dyn());
    "own potential, gradient of the wrong sign" => run(b().support(Elastic { initial_apex_distance: 0.0, argument: Argument::Position, potential: Po(|x, _| Energy { value: 0.5 * x.norm_squared(), gradient: -x, stiffness: Matrix3::identity() }) }).into_dyn());
    "own potential NaN" => run(b().support(Elastic { initial_apex_distance: 0.0, argument: Argument::Position, potential: Po(|_, _| Energy { value: NAN, gradient: Vector3::zeros(), stiffness: Matrix3::identity() }) }).into_dyn());
    "own potential, stiffness zero" => run(b().support(Elastic { initial_apex_distance: 0.0, argument: Argument::Position, potential: Po(|x, _| Energy { value: 0.5 * x.norm_squared(), gradient: *x, stiffness: Matrix3::zeros() }) }).into_dyn());
    "friction on a pole, enormous coefficient 1e9" => run(b().scene(Still::tilted(1.0)).support(touch(pole(0.02, 1e-3), 1e9)).into_dyn());
    }
}
