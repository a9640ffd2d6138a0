//! Three laws of your own: a growth profile, a tropism with a memory, an elastic law.
//!
//! A shoot bends towards a lamp that stands beside it. Nothing of what makes it do so is in the library: the profile of its
//! growth, its sense of light and the stiffening of its tissue are written here, and stand beside the library's own
//! laws as equals. The guide `docs/own-laws.md` builds this program step by step and derives the equations.
//!
//! # What to see
//! The youngest part turns to the lamp, while gravity and the shoot's own straightness hold against it, so that it looks
//! above the lamp for good. What has left the growth zone keeps its bend, and grows too stiff to hang down.
//!
//! # What to try
//! `--lamp-x 4 --lamp-z 3`, a lamp that the shoot grows past; `--sensitivity 0`, no sense of light at all; a lamp that moves,
//! for which [`Lamp::sense`](Perception::sense) finds the time in `site.environment`.

mod common;

use std::error::Error;
use std::process::ExitCode;

use common::{Axes, Opt, Options, Progress, Series, Style, Table, panels_figure};
use morphorod::Shoot;
use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
use morphorod::growth::GrowthLaw;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{
    Declaration, DirectionalTropism, Gravitropism, Memory, Perception, Proprioception, Response, SettledStatoliths,
    Site, Source,
};
use nalgebra::{Matrix3, Vector3};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;

/// REGR = (3/2) (1 − (σ/ℓg)²)/τg at distance σ from the apex: fastest at the apex, fading to nothing where the zone ends.
struct FadingGrowth {
    /// ℓg, m.
    zone_length: f64,
    /// τg, s: the mean of REGR over the zone is 1/τg.
    time: f64,
}

impl GrowthLaw for FadingGrowth {
    fn regr(&self, sigma: f64, _t: f64) -> f64 {
        1.5 * (1.0 - (sigma / self.zone_length).powi(2)) / self.time
    }

    fn zone_length(&self) -> f64 {
        self.zone_length
    }
}

/// Tissue perceives where a lamp is: the signal is (l1, l2), with l the unit vector from the point to the lamp and lj = l·dj.
struct Lamp {
    /// Where the lamp is, in the fixed frame with the base at its origin, m.
    position: Vector3<f64>,
}

impl Perception for Lamp {
    type Signal = [f64; 2];

    fn declare(&self, to: &mut Declaration) -> Source {
        to.with_position().stimulus_pair()
    }

    fn sense(&self, site: &Site, stimuli: &mut [f64]) {
        let light = site.along_directors(&(self.position - site.position).normalize());
        stimuli.copy_from_slice(&[light.x, light.y]);
    }
}

/// W = (B/2) (κ² + κ⁴/(2 κ0²)) + (B/3) τ², with κ the elastic curvature, τ the elastic twist and B = E I: tissue that
/// resists the more the further it is bent, and hardens as it ages, E = E0 (1 + age/hardening).
struct StrainStiffening {
    /// E0, Pa.
    youngs_modulus: f64,
    /// κ0, 1/m: here the couple is twice what it would be without stiffening.
    curvature: f64,
    /// Time in which mature tissue gains another E0, s.
    hardening: f64,
}

impl Constitutive for StrainStiffening {
    fn respond(&self, tissue: &Tissue, strain: &Vector3<f64>) -> ElasticResponse {
        let modulus = self.youngs_modulus * (1.0 + tissue.age / self.hardening);
        let b = modulus * std::f64::consts::PI * tissue.section.radius().powi(4) / 4.0;
        let c = 2.0 / 3.0 * b;
        let bend = Vector3::new(strain.x, strain.y, 0.0);
        let ratio = bend.norm_squared() / self.curvature.powi(2);
        ElasticResponse {
            energy: 0.5 * b * bend.norm_squared() * (1.0 + 0.5 * ratio) + 0.5 * c * strain.z.powi(2),
            couple: bend * (b * (1.0 + ratio)) + Vector3::z() * (c * strain.z),
            tangent: Matrix3::from_diagonal(&Vector3::new(b * (1.0 + ratio), b * (1.0 + ratio), c))
                + bend * bend.transpose() * (2.0 * b / self.curvature.powi(2)),
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "own_law",
        "a shoot that bends towards a lamp, by laws that are written in the example",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value("lamp-x", "CM", "12", "distance of the lamp from the base, cm"),
            Opt::value("lamp-z", "CM", "6", "height of the lamp above the base, cm"),
            Opt::value("sensitivity", "PHI", "0.8", "phototropic sensitivity"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let lamp = Vector3::new(options.get("lamp-x"), 0.0, options.get("lamp-z")) / 100.0;
    let out = options.out_dir();

    // A plant does not answer at once: its memory of the light has two stages in a row, and then a reaction time.
    let phototropism =
        DirectionalTropism { sensitivity: options.get("sensitivity"), perception: Lamp { position: lamp } }
            .remembered(Memory { time: 10.0 * MINUTE, delay: 0.0 })
            .remembered(Memory { time: 10.0 * MINUTE, delay: 5.0 * MINUTE });
    let memory = Memory { time: 12.0 * MINUTE, delay: 12.0 * MINUTE };
    let mut shoot = Shoot::builder(StrainStiffening { youngs_modulus: 1e7, curvature: 20.0, hardening: 4.0 * HOUR })
        .length(0.03)
        .radius(0.5e-3)
        .growth(FadingGrowth { zone_length: 0.04, time: 20.0 * HOUR })
        .tropism((
            phototropism,
            Gravitropism { sensitivity: 0.2, perception: SettledStatoliths }.remembered(memory),
            Proprioception { sensitivity: 20.0 }.remembered(memory),
        ))
        .load(Weight { density: 1000.0 })
        .build()?;
    let mut integrator = MethodOfSteps::new(2.0 * MINUTE);

    let mut table = Table::create(out.join("tip.csv"), &["t_s", "length_m", "x_m", "y_m", "z_m", "off_lamp_rad"])?;
    // What happens first happens within little room, and has a panel of its own.
    let (mut first, mut whole, mut tips, mut path) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let progress = Progress::new("own law");
    for row in 0..=480 {
        let t = end * f64::from(row) / 480.0;
        integrator.advance(&mut shoot, t)?;
        let (rod, tip) = (shoot.rod(), shoot.tip());
        let off = (rod.apex_frame() * Vector3::z()).angle(&(lamp - tip));
        table.row(&[t, rod.length(), tip.x, tip.y, tip.z, off])?;
        let (hours, at) = (t / HOUR, (100.0 * tip.x, 100.0 * tip.z));
        path.push(at);
        let clock = Series::text(format!("{hours} h"), (at.0, at.1 - 0.4), Style::Beside, 6);
        if [0, 12, 24, 48, 480].contains(&row) {
            let label = format!("shoot at {hours} h");
            let points = rod.centre_line_at(101).into_iter().map(|p| (100.0 * p.x, 100.0 * p.z)).collect();
            if row == 480 {
                whole.push(Series::new(label, points, Style::Line, 6));
            } else {
                let colour = first.len() / 2;
                let tip = Series::new(label, vec![at], Style::Marked, colour);
                first.extend([Series::new("", points, Style::Line, colour), tip]);
            }
            let (centimetres, degrees) = (100.0 * rod.length(), off.to_degrees());
            progress.suspend(|| println!("{hours:5.1} h: {centimetres:5.2} cm long, tip {degrees:5.1}° off the lamp"));
        }
        if row > 0 && row % 120 == 0 {
            tips.extend([Series::new("", vec![at], Style::Points, 4), clock]);
        }
        progress.set(t / end);
    }
    progress.finish();
    table.finish()?;
    let early = format!("the first {} h", end / HOUR / 10.0);
    let late = format!("all {} h, with the tip at four times", end / HOUR);
    first.push(Series::new("path of the tip", path[..=48].to_vec(), Style::Dashed, 5));
    whole.push(Series::new("path of the tip", path, Style::Dashed, 5));
    whole.append(&mut tips);
    let (x, z) = (100.0 * lamp.x, 100.0 * lamp.z);
    whole.push(Series::new("", vec![(x, z)], Style::Points, 3));
    whole.push(Series::text("lamp", (x - 0.5, z + 0.5), Style::Text, 3));
    let panels = [(early.as_str(), first.as_slice()), (late.as_str(), whole.as_slice())];
    panels_figure(out.join("shapes.svg"), "A shoot and a lamp", "x (cm)", "z (cm)", &panels, Axes::Equal)?;
    println!("tip.csv and shapes.svg are in {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    common::finish(run())
}
