//! Command-line options of the forms `--name value` and `--flag`.
//!
//! This module avoids a dependency for parsing arguments. An invalid command line ends the program
//! with a message and exit code 2. A query for an undeclared option is an error in the example and
//! panics.

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
    /// Declares an option `--name PLACEHOLDER`. The help text states the unit.
    pub const fn value(
        name: &'static str,
        placeholder: &'static str,
        default: &'static str,
        help: &'static str,
    ) -> Self {
        Self {
            name,
            placeholder: Some(placeholder),
            default,
            help,
        }
    }

    /// Declares a flag `--name`.
    pub const fn flag(name: &'static str, help: &'static str) -> Self {
        Self {
            name,
            placeholder: None,
            default: "",
            help,
        }
    }
}

/// Types that can be read from the command line.
pub trait Value: Sized {
    /// Description of valid values for the error message.
    const MUST_BE: &'static str;
    /// Parses a value; returns `None` if the text is invalid.
    fn read(text: &str) -> Option<Self>;
}

impl Value for f64 {
    const MUST_BE: &'static str = "a finite number";
    fn read(text: &str) -> Option<Self> {
        // The texts "nan" and "inf" are rejected.
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
    u32: "a non-negative integer",
    u64: "a non-negative integer",
    usize: "a non-negative integer",
    i64: "an integer",
    bool: "true or false",
    String: "a text",
    PathBuf: "a path",
}

/// Options of the command line.
pub struct Options {
    declared: Vec<Opt>,
    given: BTreeMap<&'static str, String>,
}

impl Options {
    /// Reads the command line of the program.
    ///
    /// `example` is the name in the usage text and in the default output directory, `about` is a
    /// description of one line. `--out` and `--help` are declared automatically. The program ends
    /// after `--help` and after an invalid option.
    pub fn parse(example: &str, about: &str, options: &[Opt]) -> Self {
        Self::parse_for(
            &format!("cargo run --release --example {example}"),
            example,
            about,
            options,
        )
    }

    /// Reads the command line of a program that is started by `command`.
    pub fn parse_for(command: &str, example: &str, about: &str, options: &[Opt]) -> Self {
        let mut parsed = Self {
            declared: options.to_vec(),
            given: BTreeMap::new(),
        };
        // Declared last, because the usage text lists options in the order of their declaration.
        parsed
            .declared
            .push(Opt::value("out", "DIR", "", "directory for the results"));
        let out = format!("target/out/{example}/");
        let mut args = std::env::args_os().skip(1);
        while let Some(arg) = args.next() {
            let arg = arg
                .into_string()
                .unwrap_or_else(|raw| fail(&format!("argument {raw:?} is not valid Unicode")));
            if arg == "--help" || arg == "-h" {
                // Errors are ignored, so that a closed pipe (`--help | head`) does not panic.
                let usage = parsed.usage(command, example, about, &out);
                let _ = std::io::stdout().write_all(usage.as_bytes());
                exit(0);
            }
            let (name, inline) = match arg.split_once('=') {
                Some((name, value)) => (name, Some(value.to_string())),
                None => (arg.as_str(), None),
            };
            let known = name.strip_prefix("--").and_then(|name| parsed.find(name));
            let option = known.unwrap_or_else(|| {
                fail(&format!("unknown option '{arg}'; --help lists the options"))
            });
            let value = match (option.placeholder, inline) {
                (None, None) => String::new(),
                (None, Some(value)) => fail(&format!(
                    "option {name} takes no value, but '{value}' was given"
                )),
                (Some(_), Some(value)) => value,
                (Some(placeholder), None) => args
                    .next()
                    .and_then(|value| value.into_string().ok())
                    .filter(|value| !value.starts_with("--"))
                    .unwrap_or_else(|| {
                        fail(&format!(
                            "option {name} needs a value: {name} {placeholder} ({})",
                            option.help
                        ))
                    }),
            };
            parsed.given.insert(option.name, value);
        }
        parsed.given.entry("out").or_insert(out);
        parsed
    }

    /// Returns the value of an option.
    ///
    /// Values are validated only here. Examples therefore read all options before the simulation.
    pub fn get<T: Value>(&self, name: &str) -> T {
        self.get_if(name, T::MUST_BE, |_| true)
    }

    /// Returns the value of an option that must also pass `check`. `must_be` completes the message
    /// "but must be …".
    pub fn get_if<T: Value>(&self, name: &str, must_be: &str, check: impl Fn(&T) -> bool) -> T {
        let option = self.declaration(name);
        let text = self.text(name);
        match T::read(text) {
            Some(value) if check(&value) => value,
            other => {
                let must_be = if other.is_some() { must_be } else { T::MUST_BE };
                fail(&format!(
                    "option --{name} has the value '{text}', but must be {must_be} ({})",
                    option.help
                ))
            }
        }
    }

    /// Returns a number that must be larger than 0.
    pub fn positive(&self, name: &str) -> f64 {
        self.get_if(name, "larger than 0", |value: &f64| *value > 0.0)
    }

    /// Returns the value of an option as text.
    pub fn text(&self, name: &str) -> &str {
        let option = self.declaration(name);
        self.given.get(name).map_or(option.default, String::as_str)
    }

    /// Returns whether an option was given.
    pub fn flag(&self, name: &str) -> bool {
        self.declaration(name);
        self.given.contains_key(name)
    }

    /// Creates the output directory if necessary and returns it.
    pub fn out_dir(&self) -> PathBuf {
        let dir = PathBuf::from(self.text("out"));
        if let Err(error) = std::fs::create_dir_all(&dir) {
            eprintln!(
                "error: cannot create the output directory '{}': {error}",
                dir.display()
            );
            exit(1);
        }
        dir
    }

    /// The declared option with a name.
    fn find(&self, name: &str) -> Option<Opt> {
        self.declared
            .iter()
            .find(|option| option.name == name)
            .copied()
    }

    fn declaration(&self, name: &str) -> Opt {
        self.find(name)
            .unwrap_or_else(|| panic!("the option --{name} is not declared"))
    }

    fn usage(&self, command: &str, example: &str, about: &str, out: &str) -> String {
        let left = |option: &Opt| match option.placeholder {
            Some(placeholder) => format!("--{} {placeholder}", option.name),
            None => format!("--{}", option.name),
        };
        let row = |option: &Opt| {
            let default = match (option.name, option.placeholder) {
                ("out", _) => format!(" [default: {out}]"),
                (_, Some(_)) if !option.default.is_empty() => {
                    format!(" [default: {}]", option.default)
                }
                _ => String::new(),
            };
            (left(option), format!("{}{default}", option.help))
        };
        let mut rows: Vec<(String, String)> = self.declared.iter().map(row).collect();
        rows.push(("--help".into(), "print this text".into()));
        let width = rows
            .iter()
            .map(|(left, _)| left.chars().count())
            .max()
            .unwrap_or(0);
        let mut text = format!("{example}: {about}\n\nUsage: {command} -- [OPTIONS]\n\nOptions:\n");
        for (left, right) in rows {
            text += &format!("  {left:width$}  {right}\n");
        }
        text
    }
}

fn fail(message: &str) -> ! {
    let _ = writeln!(std::io::stderr(), "error: {message}");
    exit(2)
}
