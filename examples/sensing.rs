//! Light, memories of any shape, differential growth at one place, a stochastic drive, and touch:
//! five short experiments.
//!
//! 1. *Light and gravity.* A shoot grows in light from the side. The angle from the vertical that
//!    its apex reaches is compared with tan A = m sin A_P/(1 + m cos A_P), where A_P is the angle
//!    of the light and m the ratio of the sensitivities (R. Bastien, S. Douady and B. Moulia 2015,
//!    PLoS Comput. Biol. 11:e1004037).
//! 2. *Two pulses.* Two pulses of light come from opposite sides, one after the other. A kernel
//!    with a negative lobe responds to the difference of the pulses (M. Rivière and Y. Meroz 2023,
//!    PNAS 120:e2306655120). It is fitted by exponentials.
//! 3. *A hook.* Differential growth at the basal edge of the growth zone rotates the apex of a leaf
//!    of *Averrhoa carambola* (Rivière and others 2025, `docs/laws.md`). The closed form is Δφ = 2
//!    ΔL δ̇0/(ω R), with the length ΔL (m) of this part, the radius R (m), the amplitude δ̇0 (1/s)
//!    of the difference of the growth rates over R, and the angular frequency ω (rad/s).
//! 4. *A stochastic drive.* Paths of the tips of three upright shoots under an Ornstein–Uhlenbeck
//!    process. Gravitropism limits the angle of the shoots.
//! 5. *Touch.* A shoot presses on a pole. Differential growth bends it towards the pole, and then
//!    round it.
//!
//! # Results
//! The angles agree with the closed form to 5e-10 rad. The fit of the kernel states an error of
//! 2e-7 of the largest value. The hook rotates by 8.087°, as in the closed form. With the response
//! to touch the shoot bends by 191° in 7 h, and without it by 15°.
//!
//! # Options
//! `--seed 5`: other paths. `--lobe 0`: a kernel without a negative lobe. `--touch -1`: growth away
//! from the pole.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;
use std::process::ExitCode;

use morphorod::constitutive::LinearElastic;
use morphorod::equilibrium::Unloaded;
use morphorod::growth::{Ongoing, UniformGrowth};
use morphorod::integrator::{Integrator, MethodOfSteps};
use morphorod::support::{Contact, Cylinder};
use morphorod::tropism::{
    During, Gravitropism, Handedness, Light, Localised, Memory, MemoryKernel, Oscillator,
    ParallelLight, Phototropism, Proprioception, RandomDrive, Response, SettledStatoliths,
    Thigmotropism, Touch, TropismLaw,
};
use morphorod::{DynLaws, ParameterError, Scene, Shoot, ShootParameters, Still};
use morphorod_plot::{Axes, Figure, Opt, Options, Series, Style, Table, println};
use nalgebra::Vector3;

const HOUR: f64 = 3600.0;
const MINUTE: f64 = 60.0;
const TISSUE: LinearElastic = LinearElastic {
    youngs_modulus: 1e7,
    poissons_ratio: 0.5,
};
const MEMORY: Memory = Memory {
    time: 12.0 * MINUTE,
    delay: 12.0 * MINUTE,
};
/// Radius, m.
const RADIUS: f64 = 0.5e-3;

/// Shoot of constant length (m) and radius (m) with a growth time (s), on an upright base.
fn shoot(
    (length, radius, time): (f64, f64, f64),
    law: impl TropismLaw + Send + Sync + 'static,
    scene: impl Scene + Send + Sync + 'static,
) -> Result<Shoot<DynLaws>, ParameterError> {
    let growth = Ongoing(UniformGrowth {
        zone_length: 0.07,
        time,
    });
    let builder = Shoot::builder(TISSUE)
        .length(length)
        .radius(radius)
        .elements(20)
        .growth(growth);
    builder.tropism(law).scene(scene).into_dyn().build()
}

/// Angle of the apex from the vertical towards e1, degrees.
fn angle(shoot: &Shoot<DynLaws>) -> f64 {
    let tangent = shoot.rod().apex_frame() * Vector3::z();
    tangent.x.atan2(tangent.z).to_degrees()
}

/// Angle that light and gravity set, against the ratio of the sensitivities.
fn set_angle(out: &Path) -> Result<(), Box<dyn Error>> {
    let mut table = Table::create(
        out.join("set_angle.csv"),
        &["light_deg", "ratio", "angle_deg", "closed_form_deg"],
    )?;
    let (mut series, mut worst) = (Vec::new(), 0.0_f64);
    for (index, light) in [30.0_f64, 60.0, 90.0, 120.0].into_iter().enumerate() {
        let (sin, cos) = light.to_radians().sin_cos();
        let closed = |ratio: f64| (ratio * sin).atan2(1.0 + ratio * cos).to_degrees();
        let line = (0..=100)
            .map(|i| 0.03 * f64::from(i))
            .map(|ratio| (ratio, closed(ratio)))
            .collect();
        let mut found = Vec::new();
        for ratio in [0.25, 0.5, 1.0, 2.0, 3.0] {
            let source = ParallelLight(Vector3::new(sin, 0.0, cos));
            let law = (
                Gravitropism {
                    sensitivity: 0.8,
                    perception: SettledStatoliths,
                }
                .remembered(MEMORY),
                Phototropism {
                    sensitivity: 0.8 * ratio,
                    perception: Light {
                        source,
                        strength: |irradiance: f64| irradiance,
                    },
                }
                .remembered(MEMORY),
                Proprioception { sensitivity: 4.0 }.remembered(MEMORY),
            );
            let mut shoot = shoot((0.06, RADIUS, 20.0 * HOUR), law, Still::upright())?;
            MethodOfSteps::with_solver(720.0, Unloaded).advance(&mut shoot, 150.0 * HOUR)?;
            table.row(&[light, ratio, angle(&shoot), closed(ratio)])?;
            worst = worst.max((angle(&shoot) - closed(ratio)).abs());
            found.push((ratio, angle(&shoot)));
        }
        series.push(Series::new("", line, Style::Line, index));
        series.push(Series::new(
            format!("light at {light}° from the vertical"),
            found,
            Style::Points,
            index,
        ));
    }
    table.finish()?;
    println!(
        "set angle: largest difference from the closed form {:.1e} rad",
        worst.to_radians()
    );
    let figure = Figure::new(
        out.join("set_angle.svg"),
        "Angle set by light and gravity: closed form and shoots",
    );
    figure.lines(
        "sensitivity to light over that to gravity (1)",
        "angle of the apex (°)",
        &series,
        Axes::Linear,
    )?;
    Ok(())
}

/// Responses of a memory and of a kernel with a negative lobe to pulses of light from opposite
/// sides.
fn pulses(out: &Path, lobe: f64) -> Result<(), Box<dyn Error>> {
    let gamma = |k: i32, t: f64| t.powi(k) * (-t).exp() / (1..=k).map(f64::from).product::<f64>();
    let known = |t: f64| {
        gamma(2, t / (5.0 * MINUTE)) / (5.0 * MINUTE)
            - lobe * gamma(5, t / (9.0 * MINUTE)) / (9.0 * MINUTE)
    };
    let values: Vec<f64> = (0..=400).map(|i| known(40.0 * f64::from(i))).collect();
    let (kernel, error) = MemoryKernel::fit(&values, 40.0, 6)?;
    println!(
        "kernel: {} terms, error {error:.1e} of the largest value",
        kernel.terms.len()
    );
    let hours = |t: f64| t / HOUR;
    let line = (0..=400)
        .map(|i| 40.0 * f64::from(i))
        .map(|t| (hours(t), HOUR * kernel.at(t)))
        .collect();
    let points = (0..=20)
        .map(|i| 800.0 * f64::from(i))
        .map(|t| (hours(t), HOUR * known(t)))
        .collect();
    let series = [
        Series::new("fit", line, Style::Line, 0),
        Series::new("kernel", points, Style::Points, 0),
    ];
    let figure = Figure::new(
        out.join("kernel.svg"),
        "Memory kernel with a negative lobe, and its fit by exponentials",
    );
    figure.lines(
        "time after a stimulus (h)",
        "kernel (1/h)",
        &series,
        Axes::Linear,
    )?;

    let pulse = |side: f64, from: f64| {
        let source = During {
            source: ParallelLight(Vector3::x() * side),
            from,
            until: from + 10.0 * MINUTE,
        };
        Light {
            source,
            strength: |irradiance: f64| irradiance,
        }
    };
    let exponential = MemoryKernel::from(Memory {
        time: 24.0 * MINUTE,
        delay: 0.0,
    });
    let mut table = Table::create(
        out.join("pulses.csv"),
        &["negative_lobe", "gap_min", "t_s", "angle_deg"],
    )?;
    let mut series = Vec::new();
    // Lines for pulses that are 20 and 60 min apart.
    let lines = [
        [Style::Dotted, Style::DashDot],
        [Style::Line, Style::Dashed],
    ];
    for (kind, (name, kernel)) in [("exponential", exponential), ("negative lobe", kernel)]
        .into_iter()
        .enumerate()
    {
        for (colour, gap) in [20.0, 60.0].into_iter().enumerate() {
            // Delays of half a step and more need no iteration.
            let kernel = MemoryKernel {
                delay: 2.0 * MINUTE,
                ..kernel.clone()
            };
            let response = |side, from| {
                Phototropism {
                    sensitivity: 0.5,
                    perception: pulse(side, from),
                }
                .filtered(kernel.clone())
            };
            let law = (response(1.0, 0.0), response(-1.0, gap * MINUTE));
            let mut shoot = shoot((0.03, RADIUS, 20.0 * HOUR), law, Still::weightless())?;
            let mut run = MethodOfSteps::with_solver(MINUTE, Unloaded);
            let mut line = Vec::new();
            for i in 0..=120 {
                let t = 2.0 * MINUTE * f64::from(i);
                run.advance(&mut shoot, t)?;
                table.row(&[kind as f64, gap, t, angle(&shoot)])?;
                line.push((hours(t), angle(&shoot)));
            }
            series.push(Series::new(
                format!("{name}, pulses {gap} min apart"),
                line,
                lines[kind][colour],
                colour,
            ));
        }
    }
    table.finish()?;
    let figure = Figure::new(
        out.join("pulses.svg"),
        "Two pulses of light of 10 min from opposite sides",
    );
    figure.lines("time (h)", "angle of the apex (°)", &series, Axes::Linear)?;
    Ok(())
}

/// Swing of the hook of *Averrhoa carambola*.
fn hook(out: &Path) -> Result<(), Box<dyn Error>> {
    let (radius, zone, part) = (0.26e-3, 20.6e-3, 12.2e-3);
    let (rate, difference, period) = (1.4e-2 / HOUR, 4.5e-3 / HOUR, 2.1 * HOUR);
    // Opposite senses and a phase of a quarter of a period: oscillation in the plane of e1.
    let forwards = Oscillator {
        phase: -0.5 * PI,
        ..Oscillator::new(0.5 * difference / rate, period)
    };
    let backwards = Oscillator {
        phase: -1.5 * PI,
        handedness: Handedness::Clockwise,
        ..forwards
    };
    let law = Localised {
        law: (forwards, backwards),
        from: zone - 1e-3 - part,
        to: zone - 1e-3,
        edge: 2e-3,
    };
    let mut shoot = Shoot::builder(TISSUE)
        .length(2.0 * zone)
        .radius(radius)
        .elements(40)
        .growth(UniformGrowth {
            zone_length: zone,
            time: 1.0 / rate,
        })
        .tropism(law)
        .scene(Still::weightless())
        .into_dyn()
        .build()?;
    let mut table = Table::create(out.join("hook.csv"), &["t_s", "angle_deg"])?;
    let mut run = MethodOfSteps::with_solver(period / 40.0, Unloaded);
    let mut line = Vec::new();
    for i in 0..=160 {
        run.advance(&mut shoot, period * f64::from(i) / 40.0)?;
        table.row(&[shoot.time(), angle(&shoot)])?;
        line.push((shoot.time() / HOUR, angle(&shoot)));
    }
    table.finish()?;
    let (low, high) = line.iter().fold((0.0_f64, 0.0_f64), |(low, high), (_, y)| {
        (low.min(*y), high.max(*y))
    });
    let closed = (2.0 * part * difference * period / (2.0 * PI * radius)).to_degrees();
    println!(
        "hook: swings by {:.3}°, in closed form {closed:.3}°",
        high - low
    );
    let figure = Figure::new(
        out.join("hook.svg"),
        "Swing of a hook by differential growth at one edge of its zone",
    );
    figure.lines(
        "time (h)",
        "angle of the apex (°)",
        &[Series::new("", line, Style::Line, 0)],
        Axes::Linear,
    )?;
    Ok(())
}

/// Paths of upright shoots under stochastic drives.
fn random(out: &Path, seed: u64) -> Result<(), Box<dyn Error>> {
    let mut table = Table::create(out.join("random.csv"), &["seed", "t_s", "x_mm", "y_mm"])?;
    let mut series = Vec::new();
    for (colour, seed) in (seed..seed + 3).enumerate() {
        let parameters = ShootParameters {
            length: 0.05,
            growth_time: 20.0 * HOUR,
            ..ShootParameters::default()
        };
        let drive = RandomDrive {
            sensitivity: 0.05,
            correlation_time: 24.0 * MINUTE,
            seed,
        };
        let (gravitropism, proprioception) = parameters.steering(SettledStatoliths);
        let law = (gravitropism, proprioception, drive);
        let mut shoot = parameters.reduced().tropism(law).into_dyn().build()?;
        let mut run = MethodOfSteps::new(2.0 * MINUTE);
        let mut line = Vec::new();
        for i in 0..=720 {
            run.advance(&mut shoot, 2.0 * MINUTE * f64::from(i))?;
            let tip = 1e3 * shoot.tip();
            table.row(&[seed as f64, shoot.time(), tip.x, tip.y])?;
            line.push((tip.x, tip.y));
        }
        series.push(Series::new(format!("seed {seed}"), line, Style::Line, 0).ordered(colour, 3));
    }
    table.finish()?;
    let figure = Figure::new(
        out.join("random.svg"),
        "Paths of the tip in 24 h under a stochastic drive",
    );
    figure.lines("x (mm)", "y (mm)", &series, Axes::Equal)?;
    Ok(())
}

/// Shoots that press on a pole, with a sensitivity to touch and without. Shapes at four times.
fn touch(out: &Path, sensitivity: f64) -> Result<(), Box<dyn Error>> {
    let (pole, place) = (2e-3, Vector3::new(3.2e-3, 0.0, 0.018));
    let obstacle = Cylinder {
        through: place,
        along: Vector3::y(),
        radius: pole,
    };
    let perception = Touch {
        width: 4e-3,
        threshold: 5e-3,
        saturation: 5e-2,
    };
    let mut table = Table::create(
        out.join("touch.csv"),
        &["sensitivity", "t_s", "x_mm", "z_mm", "angle_deg"],
    )?;
    let mut series = Vec::new();
    for sensitivity in [0.0, sensitivity] {
        let mut shoot = Shoot::builder(TISSUE)
            .length(0.025)
            .radius(RADIUS)
            .elements(16)
            .growth(UniformGrowth {
                zone_length: 0.025,
                time: 20.0 * HOUR,
            })
            .tropism(
                Thigmotropism {
                    sensitivity,
                    perception,
                }
                .remembered(MEMORY),
            )
            .scene(Still::weightless())
            .support(Contact {
                obstacle,
                radius: RADIUS,
                friction: 0.0,
            })
            .into_dyn()
            .build()?;
        shoot.set_intrinsic(|_| Vector3::y() * 10.0);
        let mut run = MethodOfSteps::new(2.0 * MINUTE);
        for (index, hours) in [0.0, 3.0, 5.0, 7.0].into_iter().enumerate() {
            run.advance(&mut shoot, hours * HOUR)?;
            let line: Vec<_> = shoot
                .rod()
                .centre_line_at(300)
                .iter()
                .map(|at| (1e3 * at.x, 1e3 * at.z))
                .collect();
            let turns = shoot
                .rod()
                .frames()
                .windows(2)
                .map(|ends| ends[0].rotation_to(&ends[1]).scaled_axis().y);
            let angle = turns.sum::<f64>().to_degrees();
            for (x, z) in &line {
                table.row(&[sensitivity, shoot.time(), *x, *z, angle])?;
            }
            let force: f64 = shoot.reactions().iter().map(|at| at.normal).sum();
            println!(
                "touch: sensitivity {sensitivity}, {hours} h: curved by {angle:.0}°, pressed by {force:.2e} N"
            );
            if sensitivity != 0.0 {
                series.push(
                    Series::new(format!("with touch, {hours} h"), line, Style::Line, 0)
                        .ordered(index, 4),
                );
            } else if index == 3 {
                series.push(Series::new(
                    format!("without, {hours} h"),
                    line,
                    Style::Dashed,
                    1,
                ));
            }
        }
    }
    table.finish()?;
    let angles = (0..=60).map(|i| f64::from(i) * PI / 30.0);
    let edge =
        angles.map(|angle| 1e3 * (place + pole * Vector3::new(angle.sin(), 0.0, angle.cos())));
    series.push(Series::new(
        "pole",
        edge.map(|at| (at.x, at.z)).collect(),
        Style::Line,
        6,
    ));
    let figure = Figure::new(
        out.join("touch.svg"),
        "Shoot at a pole, with and without touch",
    );
    // The shoots are about three times as high as wide.
    figure
        .width(120.0)
        .height(185.0)
        .lines("x (mm)", "z (mm)", &series, Axes::Equal)?;
    Ok(())
}

fn run() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(
        "sensing",
        "light, memory kernels, localised growth, a stochastic drive and touch",
        &[
            Opt::value("seed", "NUMBER", "1", "seed of the first stochastic drive"),
            Opt::value("touch", "CHI", "1", "sensitivity to touch"),
            Opt::value(
                "lobe",
                "SHARE",
                "0.6",
                "area of the negative lobe of the kernel over that of the positive one",
            ),
        ],
    );
    let out = options.out_dir();
    set_angle(&out)?;
    pulses(&out, options.get("lobe"))?;
    hook(&out)?;
    random(&out, options.get("seed"))?;
    touch(&out, options.get("touch"))?;
    println!("wrote tables and figures to {}", out.display());
    Ok(())
}

fn main() -> ExitCode {
    morphorod_plot::finish(run())
}
