//! Implementation of the law traits for boxed, shared and borrowed laws.

/// Implements a trait for `Box<T>`, `Arc<T>` and `&T` by forwarding to `T`. The arguments are the associated
/// types and then the methods of the trait.
macro_rules! forward_pointers {
    (@ $Trait:ident, $Pointer:ty, {
        $(type $Type:ident;)*
        $(fn $name:ident($($arg:ident: $ty:ty),*) $(-> $answer:ty)?;)*
    }) => {
        impl<T: $Trait + ?Sized> $Trait for $Pointer {
            $(type $Type = T::$Type;)*
            $(
                #[inline]
                fn $name(&self $(, $arg: $ty)*) $(-> $answer)? {
                    (**self).$name($($arg),*)
                }
            )*
        }
    };
    ($Trait:ident $methods:tt) => {
        forward_pointers!(@ $Trait, Box<T>, $methods);
        forward_pointers!(@ $Trait, std::sync::Arc<T>, $methods);
        forward_pointers!(@ $Trait, &T, $methods);
    };
}

pub(crate) use forward_pointers;
