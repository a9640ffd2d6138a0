//! A small command-line reader, enough for `--name value` and `--flag`.
//!
//! Written by hand so that the examples stay free of an argument-parsing
//! dependency. Mistakes of the user end the program with a message and exit
//! code 2; mistakes of the example's author (asking for an option that was
//! never declared) panic.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::process::exit;

/// Declaration of one command-line option.
#[derive(Clone, Copy)]
pub struct Opt {
    name: &'static str,
    placeholder: Option<&'static str>,
    default: &'static str,
    help: &'static str,
}

impl Opt {
    /// An option `--name PLACEHOLDER`; the help text should state the unit.
    pub const fn value(
        name: &'static str,
        placeholder: &'static str,
        default: &'static str,
        help: &'static str,
    ) -> Self {
        Self { name, placeholder: Some(placeholder), default, help }
    }

    /// A flag `--name`, off unless given.
    pub const fn flag(name: &'static str, help: &'static str) -> Self {
        Self { name, placeholder: None, default: "", help }
    }
}

/// A type that can be read from the command line.
pub trait Value: Sized {
    /// What a value must be, as a phrase for the error message.
    const MUST_BE: &'static str;
    /// Reads the value, or `None` if the text is not one.
    fn read(text: &str) -> Option<Self>;
}

impl Value for f64 {
    const MUST_BE: &'static str = "a finite number";
    fn read(text: &str) -> Option<Self> {
        // "nan" and "inf" parse, but no quantity of an example may be either.
        text.parse::<f64>().ok().filter(|v| v.is_finite())
    }
}

macro_rules! value_by_parse {
    ($($kind:ty: $must_be:literal),* $(,)?) => {$(
        impl Value for $kind {
            const MUST_BE: &'static str = $must_be;
            fn read(text: &str) -> Option<Self> {
                text.parse().ok()
            }
        }
    )*};
}

value_by_parse! {
    u32: "a whole number, 0 or larger",
    u64: "a whole number, 0 or larger",
    usize: "a whole number, 0 or larger",
    i64: "a whole number",
    bool: "true or false",
    String: "a text",
    PathBuf: "a path",
}

/// The options an example was started with.
pub struct Options {
    declared: Vec<Opt>,
    given: BTreeMap<&'static str, String>,
}

impl Options {
    /// Reads the command line of the running program.
    ///
    /// `example` names the program in the usage text and the default output
    /// directory, `about` says in one line what it does. `--out` and `--help`
    /// need no declaration. Does not return after `--help` or on a mistake.
    pub fn parse(example: &str, about: &str, options: &[Opt]) -> Self {
        Self::parse_for(&format!("cargo run --release --example {example}"), example, about, options)
    }

    /// The same for a program that is started by another `command` than an example.
    pub fn parse_for(command: &str, example: &str, about: &str, options: &[Opt]) -> Self {
        let mut parsed = Self { declared: options.to_vec(), given: BTreeMap::new() };
        // Declared last so that it ends the list of options in the usage text.
        parsed.declared.push(Opt::value("out", "DIR", "", "directory for the results"));
        let out = format!("target/out/{example}/");
        let mut args = std::env::args_os().skip(1);
        while let Some(arg) = args.next() {
            let arg = arg.into_string().unwrap_or_else(|raw| fail(&format!("argument {raw:?} is not valid Unicode")));
            if arg == "--help" || arg == "-h" {
                // A closed pipe (`--help | head`) is no reason to panic.
                let usage = parsed.usage(command, example, about, &out);
                let _ = std::io::stdout().write_all(usage.as_bytes());
                exit(0);
            }
            let (name, inline) = match arg.split_once('=') {
                Some((name, value)) => (name, Some(value.to_string())),
                None => (arg.as_str(), None),
            };
            let known =
                name.strip_prefix("--").and_then(|name| parsed.declared.iter().find(|o| o.name == name).copied());
            let Some(option) = known else {
                fail(&format!("unknown option '{arg}'; --help lists the options"));
            };
            let value = match (option.placeholder, inline) {
                (None, None) => String::new(),
                (None, Some(value)) => fail(&format!("option {name} takes no value, got '{value}'")),
                (Some(_), Some(value)) => value,
                (Some(placeholder), None) => args
                    .next()
                    .and_then(|value| value.into_string().ok())
                    .filter(|value| !value.starts_with("--"))
                    .unwrap_or_else(|| {
                        fail(&format!("option {name} needs a value: {name} {placeholder} ({})", option.help))
                    }),
            };
            parsed.given.insert(option.name, value);
        }
        parsed.given.entry("out").or_insert(out);
        parsed
    }

    /// The value of an option, given or default.
    ///
    /// Values are checked only here: read all options before a long run.
    pub fn get<T: Value>(&self, name: &str) -> T {
        self.get_if(name, T::MUST_BE, |_| true)
    }

    /// Like [`Options::get`], but the value must also pass `check`; `must_be`
    /// completes the sentence "the value must be ...".
    pub fn get_if<T: Value>(&self, name: &str, must_be: &str, check: impl Fn(&T) -> bool) -> T {
        let option = self.declaration(name);
        let text = self.text(name);
        match T::read(text) {
            Some(value) if check(&value) => value,
            other => {
                let must_be = if other.is_some() { must_be } else { T::MUST_BE };
                fail(&format!("option --{name} has the value '{text}', but must be {must_be} ({})", option.help))
            }
        }
    }

    /// A number that must be larger than 0.
    pub fn positive(&self, name: &str) -> f64 {
        self.get_if(name, "larger than 0", |value: &f64| *value > 0.0)
    }

    /// The value of an option as text, given or default.
    pub fn text(&self, name: &str) -> &str {
        let option = self.declaration(name);
        self.given.get(name).map_or(option.default, String::as_str)
    }

    /// Whether a flag was given.
    pub fn flag(&self, name: &str) -> bool {
        self.declaration(name);
        self.given.contains_key(name)
    }

    /// Creates the output directory if needed and returns it.
    pub fn out_dir(&self) -> PathBuf {
        let dir = PathBuf::from(self.text("out"));
        if let Err(error) = std::fs::create_dir_all(&dir) {
            eprintln!("error: cannot create the output directory '{}': {error}", dir.display());
            exit(1);
        }
        dir
    }

    fn declaration(&self, name: &str) -> Opt {
        match self.declared.iter().find(|o| o.name == name) {
            Some(option) => *option,
            None => panic!("the example asks for --{name} but does not declare it"),
        }
    }

    fn usage(&self, command: &str, example: &str, about: &str, out: &str) -> String {
        let left = |option: &Opt| match option.placeholder {
            Some(placeholder) => format!("--{} {placeholder}", option.name),
            None => format!("--{}", option.name),
        };
        let mut rows: Vec<(String, String)> = self
            .declared
            .iter()
            .map(|option| {
                let default = match (option.name, option.placeholder) {
                    ("out", _) => format!(" [default: {out}]"),
                    (_, Some(_)) if !option.default.is_empty() => format!(" [default: {}]", option.default),
                    _ => String::new(),
                };
                (left(option), format!("{}{default}", option.help))
            })
            .collect();
        rows.push(("--help".into(), "print this text".into()));
        let width = rows.iter().map(|(l, _)| l.chars().count()).max();
        let width = width.unwrap_or(0);
        let mut text = format!("{example}: {about}\n\n");
        text += &format!("Usage: {command} -- [OPTIONS]\n\n");
        text += "Options:\n";
        for (left, right) in rows {
            text += &format!("  {left:width$}  {right}\n");
        }
        text
    }
}

fn fail(message: &str) -> ! {
    eprintln!("error: {message}");
    exit(2)
}
