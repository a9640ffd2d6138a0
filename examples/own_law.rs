//! A shoot that bends towards a lamp, with three laws that are defined in this example.
//!
//! The laws are a growth profile, a phototropism with memory, and an elastic law for tissue that
//! stiffens under strain and with age. They implement the traits of the library and are used like
//! its own laws. The chapter `docs/own-laws.md` derives the equations and develops this program
//! step by step.
//!
//! # Results
//! The apical part of the shoot bends towards the lamp. Gravitropism and proprioception counteract
//! phototropism, so that the tip points to a place above the lamp. Tissue that has left the growth
//! zone retains its curvature, and its stiffness increases so fast that the shoot does not sag.
//!
//! # Options
//! - `--lamp-x 4 --lamp-z 3`: the shoot grows past the lamp.
//! - `--sensitivity 0`: no phototropism.
//! - For a moving lamp, change [`Lamp::sense`](Perception::sense); `site.environment` contains the
//!   time.

use std::error::Error;
use std::process::ExitCode;

use morphorod::Shoot;
use morphorod::constitutive::{Constitutive, ElasticResponse, Tissue};
use morphorod::growth::GrowthLaw;
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::load::Weight;
use morphorod::tropism::{
    Declaration, DirectionalTropism, Gravitropism, Memory, Perception, Proprioception, Response,
    SettledStatoliths, Site, Source,
};
use morphorod_plot::{Axes, Figure, Opt, Options, Progress, Series, Style, Table, println};
use nalgebra::{Matrix3, Vector3};

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;

/// Growth with REGR = (3/2) (1 − (σ/ℓg)²)/τg at distance σ from the apex. It is largest at the apex
/// and zero at the end of the growth zone.
struct FadingGrowth {
    /// Length of the growth zone ℓg, m.
    zone_length: f64,
    /// Growth time τg, s. The mean of REGR over the growth zone is 1/τg.
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

/// Perception of the direction of a lamp. The signal is (l1, l2), where l is the unit vector from
/// the point to the lamp, and lj = l·dj.
struct Lamp {
    /// Position of the lamp in the fixed frame, whose origin is the base, m.
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

/// Elastic law with the energy W = (B/2) (κ² + κ⁴/(2 κ0²)) + (B/3) τ², where κ is the elastic
/// curvature, τ the elastic twist and B = E I. The bending stiffness increases with the curvature.
/// Young's modulus increases with the age of the tissue, E = E0 (1 + age/hardening).
struct StrainStiffening {
    /// Young's modulus E0 of tissue in the growth zone, Pa.
    youngs_modulus: f64,
    /// Curvature κ0 at which stiffening doubles the couple, 1/m.
    curvature: f64,
    /// Time in which the modulus of mature tissue increases by E0, s.
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
            energy: 0.5 * b * bend.norm_squared() * (1.0 + 0.5 * ratio)
                + 0.5 * c * strain.z.powi(2),
            couple: bend * (b * (1.0 + ratio)) + Vector3::z() * (c * strain.z),
            tangent: Matrix3::from_diagonal(&Vector3::new(b * (1.0 + ratio), b * (1.0 + ratio), c))
                + bend * bend.transpose() * (2.0 * b / self.curvature.powi(2)),
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "own_law",
        "a shoot that bends towards a lamp, with laws that are defined in the example",
        &[
            Opt::value("hours", "H", "40", "time to simulate, h"),
            Opt::value(
                "lamp-x",
                "CM",
                "12",
                "distance of the lamp from the base, cm",
            ),
            Opt::value("lamp-z", "CM", "6", "height of the lamp above the base, cm"),
            Opt::value("sensitivity", "PHI", "0.8", "phototropic sensitivity"),
        ],
    );
    let end = HOUR * options.positive("hours");
    let lamp = Vector3::new(options.get("lamp-x"), 0.0, options.get("lamp-z")) / 100.0;
    let out = options.out_dir();

    // The response to light is filtered by two memories in series, and delayed by a reaction time.
    let phototropism = DirectionalTropism {
        sensitivity: options.get("sensitivity"),
        perception: Lamp { position: lamp },
    }
    .remembered(Memory {
        time: 10.0 * MINUTE,
        delay: 0.0,
    })
    .remembered(Memory {
        time: 10.0 * MINUTE,
        delay: 5.0 * MINUTE,
    });
    let memory = Memory {
        time: 12.0 * MINUTE,
        delay: 12.0 * MINUTE,
    };
    let mut shoot = Shoot::builder(StrainStiffening {
        youngs_modulus: 1e7,
        curvature: 20.0,
        hardening: 4.0 * HOUR,
    })
    .length(0.03)
    .radius(0.5e-3)
    .growth(FadingGrowth {
        zone_length: 0.04,
        time: 20.0 * HOUR,
    })
    .tropism((
        phototropism,
        Gravitropism {
            sensitivity: 0.2,
            perception: SettledStatoliths,
        }
        .remembered(memory),
        Proprioception { sensitivity: 20.0 }.remembered(memory),
    ))
    .load(Weight { density: 1000.0 })
    .build()?;
    let mut integrator = MethodOfSteps::new(2.0 * MINUTE);

    let mut table = Table::create(
        out.join("tip.csv"),
        &["t_s", "length_m", "x_m", "y_m", "z_m", "off_lamp_rad"],
    )?;
    // The first tenth of the time has a panel of its own.
    let (mut first, mut whole, mut tips, mut path) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
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
            let points = rod
                .centre_line_at(101)
                .into_iter()
                .map(|p| (100.0 * p.x, 100.0 * p.z))
                .collect();
            if row == 480 {
                whole.push(Series::new(label, points, Style::Line, 6));
            } else {
                let colour = first.len() / 2;
                let tip = Series::new(label, vec![at], Style::Marked, colour);
                first.extend([Series::new("", points, Style::Line, colour), tip]);
            }
            let (centimetres, degrees) = (100.0 * rod.length(), off.to_degrees());
            progress.suspend(|| {
                println!(
                    "{hours:5.1} h: length {centimetres:5.2} cm, angle between apical tangent and lamp {degrees:5.1}°"
                )
            });
        }
        if row > 0 && row % 120 == 0 {
            tips.extend([Series::new("", vec![at], Style::Points, 4), clock]);
        }
        progress.set(t / end);
    }
    progress.finish();
    table.finish()?;
    let early = format!("0 to {} h", end / HOUR / 10.0);
    let late = format!("0 to {} h, markers: tip at four times", end / HOUR);
    first.push(Series::new(
        "tip track",
        path[..=48].to_vec(),
        Style::Dashed,
        5,
    ));
    whole.push(Series::new("tip track", path, Style::Dashed, 5));
    whole.append(&mut tips);
    let (x, z) = (100.0 * lamp.x, 100.0 * lamp.z);
    whole.push(Series::new("", vec![(x, z)], Style::Points, 3));
    whole.push(Series::text("lamp", (x - 0.5, z + 0.5), Style::Text, 3));
    let panels = [
        (early.as_str(), first.as_slice()),
        (late.as_str(), whole.as_slice()),
    ];
    Figure::new(
        out.join("shapes.svg"),
        "Shapes and tip track of a shoot beside a lamp",
    )
    .panels("x (cm)", "z (cm)", &panels, Axes::Equal)?;
    println!("wrote tip.csv and shapes.svg to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
