include!("zz_stab.rs");
#[test]
fn debug_roots() {
    for (l, tg) in [(0.06, 20.0), (0.07, 20.0), (0.06, 10.0)] {
        let lin = upright(l, tg, 0.8, 20.0, 3, None).unwrap();
        println!("l {l} tg {tg} {:?}", lin.unstable());
        let t0 = Instant::now();
        println!("  ess {:?} {:?}", lin.essential(), t0.elapsed());
        for a in [-2e-4, -1e-4, -5e-5, -1e-5, 1e-9] {
            let t0 = Instant::now();
            println!(
                "  {a} {:?} {:?}",
                lin.roots(a).map(|r| r.iter().map(|r| (r.value, r.multiplicity, r.residual)).collect::<Vec<_>>()),
                t0.elapsed()
            );
        }
    }
}
