//! Implementation of the law traits for options, lists and tuples of laws.

/// Implements a trait for `Option<T>`, `Vec<T>` and tuples of up to six types that implement it.
/// The second argument is a macro that writes the methods of a composition: its arguments are
/// `self`, and one or more iterators over the parts.
macro_rules! compositions {
    ($Trait:ident, $methods:ident) => {
        #[doc = concat!("A [`", stringify!($Trait), "`] that may be absent: `None` equals `()`.")]
        impl<T: $Trait> $Trait for Option<T> {
            $methods!(self: self.iter());
        }

        #[doc = concat!("Parts of one type, or of any types in a `Vec<Box<dyn ", stringify!($Trait), ">>`.")]
        impl<T: $Trait> $Trait for Vec<T> {
            $methods!(self: self);
        }

        compositions!(@ $Trait, $methods, A 0);
        compositions!(@ $Trait, $methods, A 0, B 1);
        compositions!(@ $Trait, $methods, A 0, B 1, C 2);
        compositions!(@ $Trait, $methods, A 0, B 1, C 2, D 3);
        compositions!(@ $Trait, $methods, A 0, B 1, C 2, D 3, E 4);
        compositions!(@ $Trait, $methods, A 0, B 1, C 2, D 3, E 4, F 5);
    };
    (@ $Trait:ident, $methods:ident, $($Part:ident $index:tt),*) => {
        impl<$($Part: $Trait),*> $Trait for ($($Part,)*) {
            $methods!(self: $([&self.$index]),*);
        }
    };
}

/// A value that results from all parts: a first value, and a change of it by each part.
macro_rules! combined {
    ($first:expr, |$value:ident, $part:ident| $change:expr; $($parts:expr),*) => {{
        let mut $value = $first;
        $(for $part in $parts {
            $change;
        })*
        $value
    }};
}

pub(crate) use {combined, compositions};
