//! The analysis of the example: a fit without an oscillator, a scan for one, and a fit with it.

use std::error::Error;

use morphorod::fit::{Estimates, Family, Fit, FitError, Parameter, Scan, Series, Verdict};
use morphorod::tropism::Oscillator;
use morphorod::{DynLaws, ParameterError, Shoot};
use morphorod_plot::{Options, Progress, println};

use super::plants::{OSCILLATOR, PARAMETERS, Plant};
use super::setting::Setting;

const MINUTE: f64 = 60.0;

/// Probability of a false alarm below which the program fits an oscillator.
const ALARM: f64 = 0.01;

/// Difference of BIC above which the evidence for an oscillator is very strong.
const STRONG: f64 = 10.0;

/// Derivative of an estimate below which the table of dependences omits it.
const SMALL: f64 = 0.05;

/// A setting with its data.
pub struct Analysis {
    /// Settings of the fit.
    pub fit: Fit,
    /// The shoot and its parameters.
    pub setting: Setting,
    /// Data.
    pub series: [Series; 1],
    /// Parameters of the camera.
    pub cameras: Vec<Parameter>,
}

impl Analysis {
    /// Fits without an oscillator, and with one if the scan finds it. Prints the results. Returns
    /// the last fit.
    pub fn run(&self, options: &Options) -> Result<(Plant, Estimates), Box<dyn Error>> {
        let (setting, family) = (&self.setting, self.setting.family(&self.cameras));
        let found = self.fitted(&family)?;
        self.report(setting.plant, &found)?;
        if setting.righting
            || setting.free.contains(&"alpha")
            || family.parameters[OSCILLATOR.start].start != 0.0
        {
            return Ok((setting.plant, found));
        }
        let periods = match options.text("periods") {
            "" => found.resolved_periods(),
            text => {
                let wrong = || format!("--periods is '{text}', but must be MIN:MAX in minutes");
                let (shortest, longest) = text.split_once(':').ok_or_else(wrong)?;
                let minutes = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
                [MINUTE * minutes(shortest)?, MINUTE * minutes(longest)?]
            }
        };
        if periods[0] >= periods[1] {
            println!(
                "conclusion: the frames are too few for a scan for an internal oscillator{}",
                but(&found)
            );
            return Ok((setting.plant, found));
        }
        // The scan begins with the longest period. Lines between those with large scores follow.
        let progress = Progress::new("scan");
        let frequencies = periods.map(f64::recip);
        let build = |p: &[f64], oscillator: Oscillator| {
            progress.set(
                (oscillator.period.recip() - frequencies[1]) / (frequencies[0] - frequencies[1]),
            );
            setting.plant.build(p, oscillator)
        };
        let scan = self.fit.scan_oscillator(build, &found, periods)?;
        progress.clear();
        println!("\n{scan}");
        if scan.false_alarm >= ALARM {
            println!(
                "conclusion: no evidence for an internal oscillator with a period in this range{}",
                but(&found)
            );
            return Ok((setting.plant, found));
        }
        match self.with_oscillator(&family, &scan) {
            Ok((plant, with)) => {
                self.report(plant, &with)?;
                let difference = with.compare(&found)?;
                println!("BIC without an oscillator minus BIC with it: {difference:.1}");
                if difference > STRONG {
                    println!(
                        "conclusion: an internal oscillator explains the data better{}",
                        but(&with)
                    );
                    return Ok((plant, with));
                }
                println!(
                    "conclusion: no clear evidence for an internal oscillator{}",
                    but(&with)
                );
            }
            Err(error) => {
                println!("the fit with an oscillator failed: {error}\nconclusion: undecided")
            }
        }
        Ok((setting.plant, found))
    }

    /// Fit from the best oscillator of a scan. The other initial values are those of the first fit,
    /// whose estimates may be far from the truth.
    fn with_oscillator<F>(
        &self,
        first: &Family<F>,
        scan: &Scan,
    ) -> Result<(Plant, Estimates), FitError> {
        let (best, setting) = (scan.best.oscillator, &self.setting);
        let mut start: Vec<f64> = first.parameters[..PARAMETERS.len()]
            .iter()
            .map(|one| one.start)
            .collect();
        start[OSCILLATOR].copy_from_slice(&[best.sensitivity, best.period, best.phase]);
        let names: Vec<&str> = setting
            .free
            .iter()
            .copied()
            .chain(["alpha", "tau_e", "phase"])
            .collect();
        let plant = Plant {
            handedness: best.handedness,
            ..setting.plant
        };
        let family = setting.bounded(plant.family(&start, &names, 1.0, self.cameras.clone()));
        Ok((plant, self.fitted(&family)?))
    }

    /// Estimates of a family.
    fn fitted(
        &self,
        family: &Family<impl Fn(&[f64]) -> Result<Shoot<DynLaws>, ParameterError> + Sync>,
    ) -> Result<Estimates, FitError> {
        let progress = Progress::new("fit");
        let found = self
            .fit
            .run_showing(family, &self.series, |part| progress.set(part));
        progress.clear();
        found
    }

    /// Prints estimates, with their dependence on given values.
    fn report(&self, plant: Plant, found: &Estimates) -> Result<(), FitError> {
        let build = |p: &[f64]| plant.build(p, plant.oscillator(p));
        println!("{found}");
        println!("relative change of estimates per relative change of a given value:");
        for dependence in self.fit.dependences(build, found)? {
            let large = dependence
                .slopes
                .iter()
                .filter(|(_, slope)| slope.abs() > SMALL);
            let text: Vec<String> = large
                .map(|(name, slope)| format!("{name} {slope:+.2}"))
                .collect();
            if !text.is_empty() {
                println!("{:>15}: {}", dependence.given, text.join(", "));
            }
        }
        let estimated = || {
            found
                .parameters
                .iter()
                .filter(|one| one.verdict != Verdict::Fixed)
        };
        if estimated().count() > 0 && estimated().all(|one| one.verdict == Verdict::StructurallyNot)
        {
            println!(
                "the fitted shoot does not move: give --tilt, or an initial curvature by --free bend_x,bend_y,…"
            );
        }
        Ok(())
    }
}

/// The end of a conclusion from a fit with warnings.
fn but(found: &Estimates) -> &'static str {
    if found.warnings.is_empty() {
        ""
    } else {
        ", but the warnings of the fit may have another cause"
    }
}
