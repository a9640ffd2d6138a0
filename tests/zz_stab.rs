use morphorod::constitutive::*;
use morphorod::growth::*;
use morphorod::load::*;
use morphorod::stability::*;
use morphorod::tropism::*;
use morphorod::*;
use std::time::Instant;

fn upright(
    l: f64,
    tg_h: f64,
    beta: f64,
    eta: f64,
    n: usize,
    tau_a: Option<f64>,
) -> Result<Linearisation, StabilityError> {
    let m = Memory { time: 720.0, delay: 720.0 };
    let b = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
        .length(l)
        .radius(5e-4)
        .elements(n)
        .growth(Ongoing(UniformGrowth { zone_length: 0.1, time: tg_h * 3600.0 }))
        .load(Weight { density: 1000.0 });
    match tau_a {
        None => {
            let mut s = b
                .tropism((
                    Gravitropism { sensitivity: beta, memory: m, statoliths: SettledStatoliths },
                    Proprioception { sensitivity: eta, memory: m },
                ))
                .build()?;
            let _ = StationarySolver::default().solve(&mut s)?;
            Linearisation::about(&s)
        }
        Some(t) => {
            let mut s = b
                .tropism((
                    Gravitropism { sensitivity: beta, memory: m, statoliths: Statoliths { avalanche_time: t } },
                    Proprioception { sensitivity: eta, memory: m },
                ))
                .build()?;
            let _ = StationarySolver::default().solve(&mut s)?;
            Linearisation::about(&s)
        }
    }
}

#[test]
fn table() {
    for n in [2, 3, 4, 6] {
        for (beta, eta, tg, ta, lo, hi, l, period) in [
            (0.8, 20.0, 20.0, None, 0.06, 0.07, 6.5614866491, 87.6383587),
            (0.8, 20.0, 40.0, None, 0.06, 0.077, 7.2407759341, 87.6383587),
            (0.8, 20.0, 10.0, None, 0.045, 0.06, 5.2368383610, 87.6383587),
            (0.8, 0.0, 20.0, None, 0.06, 0.075, 7.1003931291, 87.6383587),
            (0.8, 20.0, 20.0, Some(120.0), 0.06, 0.07, 6.4595221175, 92.7692307),
        ] {
            let t0 = Instant::now();
            let o = onset(|p| upright(p, tg, beta, eta, n, ta), lo, hi);
            let dt = t0.elapsed();
            match o {
                Ok(o) => println!(
                    "{n} {eta} {tg} {:.2e} {:.2e} {} {dt:?} {o:?}",
                    o.parameter * 100.0 / l - 1.0,
                    o.period() / 60.0 / period - 1.0,
                    o.linearisations
                ),
                Err(e) => println!("{n} {eta} {tg} ERR {e} {dt:?}"),
            }
        }
    }
    let t0 = Instant::now();
    let lin = upright(0.0659, 20.0, 0.8, 20.0, 4, None).unwrap();
    println!("linearise {:?} unknowns {}", t0.elapsed(), lin.unknowns());
    let t0 = Instant::now();
    println!("{:?} {:?}", lin.unstable(), t0.elapsed());
    let t0 = Instant::now();
    println!("{:?} {:?}", lin.essential(), t0.elapsed());
    let t0 = Instant::now();
    let r = lin.rightmost().unwrap();
    println!("{:?} {} {} {:?} {:?}", r.value, r.residual, r.multiplicity, r.polarisation, t0.elapsed());
}
