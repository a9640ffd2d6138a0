include!("zz_stab.rs");
use std::f64::consts::FRAC_PI_2;
#[test]
fn stationary() {
    for scale in [1e-2, 0.1, 1.0, 10.0, 100.0] {
        let m = Memory { time: 720.0, delay: 720.0 };
        for n in [8, 16] {
            let mut s = Shoot::builder(LinearElastic { youngs_modulus: 1e7 / scale, poissons_ratio: 0.5 })
                .length(0.05)
                .radius(5e-4)
                .elements(n)
                .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: 72000.0 }))
                .tropism((
                    Gravitropism { sensitivity: 0.8, memory: m, statoliths: SettledStatoliths },
                    Proprioception { sensitivity: 20.0, memory: m },
                ))
                .load(Weight { density: 1000.0 })
                .scene(Still::tilted(FRAC_PI_2))
                .build()
                .unwrap();
            let t0 = Instant::now();
            let r = StationarySolver::default().solve(&mut s);
            let dt = t0.elapsed();
            let k = 0.8 / (20.0 * 5e-4);
            let l = 0.05f64;
            let exact = nalgebra::Vector3::new(2.0 / k * (k * l / 2.0).tanh().atan(), 0.0, (k * l).cosh().ln() / k);
            println!("{scale} {n} {:?} {:.2e} {dt:?}", r, (s.tip() - exact).norm());
            if r.is_ok() && n == 8 {
                let t0 = Instant::now();
                let lin = Linearisation::about(&s).unwrap();
                println!("   {:?} {:?} {:?}", lin.unknowns(), lin.unstable(), t0.elapsed());
                let r = lin.rightmost().map(|r| (r.value, r.multiplicity, r.polarisation, r.residual));
                println!("   {r:?} {:?}", t0.elapsed());
            }
        }
    }
}
#[test]
fn micro() {
    let m = Memory { time: 720.0, delay: 720.0 };
    let t0 = Instant::now();
    let o = onset(
        |tg| {
            let mut s = Shoot::builder(LinearElastic { youngs_modulus: 1e7, poissons_ratio: 0.5 })
                .length(0.05)
                .radius(5e-4)
                .elements(2)
                .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: tg * 3600.0 }))
                .tropism(Proprioception { sensitivity: 20.0, memory: m })
                .scene(Still::weightless())
                .build()?;
            let _ = StationarySolver::default().solve(&mut s)?;
            Linearisation::about(&s)
        },
        2.0,
        6.0,
    );
    println!("{o:?} {:?} {:?}", o.clone().map(|o| o.parameter / 3.52449410960937 - 1.0), t0.elapsed());
    for tg in [0.1, 1.0, 5.0, 20.0, 100.0] {
        let mut s = Shoot::builder(LinearElastic { youngs_modulus: 1e13, poissons_ratio: 0.5 })
            .length(0.065)
            .radius(5e-4)
            .elements(3)
            .growth(Ongoing(UniformGrowth { zone_length: 0.07, time: tg * 3600.0 }))
            .tropism(Gravitropism { sensitivity: 0.8, memory: m, statoliths: SettledStatoliths })
            .load(Weight { density: 1000.0 })
            .build()
            .unwrap();
        let _ = StationarySolver::default().solve(&mut s).unwrap();
        let lin = Linearisation::about(&s).unwrap();
        println!("rigid {tg} {:?}", lin.unstable());
    }
}
