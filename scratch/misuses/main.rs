mod cases1; mod cases2; mod cases3;
use std::panic; use std::sync::mpsc; use std::time::Duration; use std::io::Write;
pub type E = Box<dyn std::error::Error>;
pub type R = Result<String, E>;
pub type Case = (&'static str, Box<dyn FnOnce() -> R + Send>);
pub fn show(e: &dyn std::error::Error) -> String {
    let mut s = e.to_string(); let mut at = e.source();
    while let Some(x) = at { s += &format!(" <- {x}"); at = x.source(); } s
}
fn main() {
    panic::set_hook(Box::new(|_| {}));
    let only = std::env::args().nth(1);
    let mut all: Vec<Case> = Vec::new();
    cases1::cases(&mut all); cases2::cases(&mut all); cases3::cases(&mut all);
    for (n, (name, f)) in all.into_iter().enumerate() {
        if let Some(o) = &only { if !name.contains(o.as_str()) && o.parse() != Ok(n + 1) { continue; } }
        let (tx, rx) = mpsc::channel();
        std::thread::Builder::new().stack_size(16 << 20).spawn(move || {
            let r = panic::catch_unwind(panic::AssertUnwindSafe(f));
            let s = match r { Ok(Ok(s)) => format!("ANSWER {s}"), Ok(Err(e)) => show(&*e),
                Err(p) => format!("PANIC {}", p.downcast_ref::<String>().cloned().or(p.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default()) };
            let _ = tx.send(s);
        }).unwrap();
        let s = rx.recv_timeout(Duration::from_secs(20)).unwrap_or_else(|_| "> 20 s".into());
        println!("[{}] {name} => {s}", n + 1); std::io::stdout().flush().unwrap();
    }
    std::process::exit(0);
}
