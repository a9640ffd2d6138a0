//! Implementation of the law traits for boxed, shared and borrowed laws, and by forwarding to a
//! part.

/// Implements methods of a trait by forwarding to a part of `self`, which implements the same or
/// another trait: `forward_methods!(self, Trait of part => methods)`.
macro_rules! forward_methods {
    ($self:ident, $Trait:ident of $part:expr => $(fn $name:ident($($arg:ident: $ty:ty),*) $(-> $answer:ty)?;)*) => {
        $(
            #[inline(always)]
            fn $name(&$self $(, $arg: $ty)*) $(-> $answer)? {
                $Trait::$name(&$part $(, $arg)*)
            }
        )*
    };
}

/// Implements a trait for `Box<T>`, `Arc<T>` and `&T` by forwarding to `T`. The arguments are the
/// associated types and then the methods of the trait. A macro that forwards further methods may
/// precede them.
macro_rules! forward_pointers {
    (@ $Trait:ident $($more:ident)?, $Pointer:ty, {
        $(type $Type:ident;)*
        $(fn $name:ident($($arg:ident: $ty:ty),*) $(-> $answer:ty)?;)*
    }) => {
        impl<T: $Trait + ?Sized> $Trait for $Pointer {
            $(type $Type = T::$Type;)*
            $crate::pointers::forward_methods!(self, $Trait of **self => $(fn $name($($arg: $ty),*) $(-> $answer)?;)*);
            $($more!(self, **self);)?
        }
    };
    ($Trait:ident $($more:ident)? { $($methods:tt)* }) => {
        forward_pointers!(@ $Trait $($more)?, Box<T>, { $($methods)* });
        forward_pointers!(@ $Trait $($more)?, std::sync::Arc<T>, { $($methods)* });
        forward_pointers!(@ $Trait $($more)?, &T, { $($methods)* });
    };
}

pub(crate) use {forward_methods, forward_pointers};
