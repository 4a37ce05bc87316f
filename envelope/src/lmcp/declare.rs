//! Declarations of message types: one compact form, from which the Rust type, its defaults, codec,
//! schema and access by name follow.
//!
//! ```text
//! lmcp_enums! {
//!     /// What an altitude is measured from.
//!     AltitudeType { AGL = 0, MSL = 1 }
//! }
//! lmcp_types! {
//!     CMASI "afrl.cmasi";
//!     /// A point on or above the earth.
//!     3 Location3D {
//!         latitude "Latitude" ["deg"]: f64,
//!         altitude_type "AltitudeType": AltitudeType = AltitudeType::MSL,
//!     }
//!     /// A place of a route.
//!     35 Waypoint: Location3D { number "Number": i64 }
//!     /// What every task has.
//!     8 Task in Box { task_id "TaskID": i64 }
//! }
//! ```
//!
//! `in Box` is for a type that fields hold seldom or in the form of its descendants: an object of it stands behind a
//! pointer, so that a field without one stays small.

/// Declares enumerations of the model: numbers, the declared ones with names. The first is the default.
macro_rules! lmcp_enums {
    ($(
        $(#[$doc:meta])*
        $name:ident { $first:ident = $first_value:literal $(, $value_name:ident = $value:literal)* $(,)? }
    )*) => { $(
        $(#[$doc])*
        ///
        /// A number without a name is kept as it came.
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub i32);

        #[allow(non_upper_case_globals, reason = "the model's own names")]
        impl $name {
            #[doc = concat!("`", stringify!($first), "`, ", $first_value, " on the wire.")]
            pub const $first: Self = Self($first_value);
            $(
                #[doc = concat!("`", stringify!($value_name), "`, ", $value, " on the wire.")]
                pub const $value_name: Self = Self($value);
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self::$first
            }
        }

        impl $crate::lmcp::Enumeration for $name {
            const INFO: &'static $crate::lmcp::EnumInfo = &$crate::lmcp::EnumInfo {
                name: stringify!($name),
                values: &[
                    (stringify!($first), $first_value)
                    $(, (stringify!($value_name), $value))*
                ],
            };
            const FIRST: Self = Self::$first;
            fn number(&self) -> i32 {
                self.0
            }
            fn number_mut(&mut self) -> &mut i32 {
                &mut self.0
            }
        }

        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                $crate::lmcp::Value::view(self).fmt(f)
            }
        }
    )* };
}

/// Declares types of a series, and `TYPES`, the list of what was declared.
macro_rules! lmcp_types {
    (
        $series:ident $namespace:literal;
        $(
            $(#[$doc:meta])*
            $id:literal $name:ident $(: $parent:ident)? $(in $place:ident)? {
                $($field:ident $wire:literal $([$unit:literal])? : $type:ty $(= $default:expr)?),* $(,)?
            }
        )*
    ) => {
        /// The types declared in this file.
        pub(super) const TYPES: &[&$crate::lmcp::TypeInfo] = &[
            $(<$name as $crate::lmcp::Struct>::TYPE),*
        ];

        $(
            $(#[$doc])*
            #[doc = concat!("\n\n`", $namespace, ".", stringify!($name), "`, type ", $id, " of its series.")]
            #[derive(Clone)]
            pub struct $name {
                $(
                    #[doc = concat!("What every [`", stringify!($parent), "`] has.")]
                    pub base: $parent,
                )?
                $(
                    #[doc = concat!("`", $wire, "`" $(, " in ", $unit)?, ".")]
                    pub $field: $type,
                )*
            }

            $(lmcp_types!(@deref $name $parent);)?

            impl Default for $name {
                fn default() -> Self {
                    Self {
                        $(base: <$parent>::default(),)?
                        $($field: lmcp_types!(@default $type $(, $default)?),)*
                    }
                }
            }

            impl $crate::lmcp::Struct for $name {
                type Place = lmcp_types!(@place $name $($place)?);
                const TYPE: &'static $crate::lmcp::TypeInfo = &$crate::lmcp::TypeInfo {
                    series: &$series,
                    id: $id,
                    name: stringify!($name),
                    full_name: concat!($namespace, ".", stringify!($name)),
                    parent: lmcp_types!(@parent $($parent)?),
                    own_fields: &[$(
                        $crate::lmcp::FieldInfo {
                            name: $wire,
                            unit: concat!($($unit)?),
                            kind: <$type as $crate::lmcp::Value>::KIND,
                        },
                    )*],
                    header: $series.header($id),
                    size: size_of::<$name>(),
                    default: || Box::new(Self::default()),
                };
            }

            #[allow(unused_variables, reason = "a type may have no fields")]
            impl $crate::lmcp::Object for $name {
                fn type_info(&self) -> &'static $crate::lmcp::TypeInfo {
                    <Self as $crate::lmcp::Struct>::TYPE
                }
                fn base(&self) -> Option<&dyn $crate::lmcp::Object> {
                    lmcp_types!(@base &self $(, $parent)?)
                }
                fn base_mut(&mut self) -> Option<&mut dyn $crate::lmcp::Object> {
                    lmcp_types!(@base &mut self $(, $parent)?)
                }
                fn view(&self, field: &str) -> Option<$crate::lmcp::View<'_>> {
                    match field {
                        $($wire => Some($crate::lmcp::Value::view(&self.$field)),)*
                        _ => self.base()?.view(field),
                    }
                }
                fn slot(&mut self, field: &str) -> Option<$crate::lmcp::Slot<'_>> {
                    match field {
                        $($wire => Some($crate::lmcp::Value::slot(&mut self.$field)),)*
                        _ => self.base_mut()?.slot(field),
                    }
                }
                fn decode_fields(
                    &mut self,
                    reader: &mut $crate::lmcp::Reader<'_>,
                ) -> $crate::lmcp::Decoded<()> {
                    $(<$parent as $crate::lmcp::Object>::decode_fields(&mut self.base, reader)?;)?
                    $(
                        const { $crate::lmcp::schema::Run::at(<$name as $crate::lmcp::Struct>::TYPE, $wire) }
                            .check(reader)?;
                        reader.field($wire, &mut self.$field)?;
                    )*
                    Ok(())
                }
                fn encode_fields(
                    &self,
                    writer: &mut $crate::lmcp::Writer<'_>,
                ) -> $crate::lmcp::Encoded {
                    $(<$parent as $crate::lmcp::Object>::encode_fields(&self.base, writer)?;)?
                    $(writer.field($wire, &self.$field)?;)*
                    Ok(())
                }
                fn apart(&self) -> usize {
                    0 $(+ <$parent as $crate::lmcp::Object>::apart(&self.base))?
                        $(+ $crate::lmcp::Value::apart(&self.$field))*
                }
                fn clone_box(&self) -> Box<dyn $crate::lmcp::Object> {
                    Box::new(self.clone())
                }
            }

            impl PartialEq for $name {
                fn eq(&self, other: &Self) -> bool {
                    let (a, b): (&dyn $crate::lmcp::Object, &dyn $crate::lmcp::Object) = (self, other);
                    a == b
                }
            }

            impl std::fmt::Debug for $name {
                fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                    $crate::lmcp::object::debug(self, f)
                }
            }
        )*
    };
    (@place $name:ident) => { $crate::lmcp::Inline<$name> };
    (@place $name:ident $place:ident) => { $place<$name> };
    (@deref $name:ident $parent:ident) => {
        impl std::ops::Deref for $name {
            type Target = $parent;
            fn deref(&self) -> &$parent {
                &self.base
            }
        }
        impl std::ops::DerefMut for $name {
            fn deref_mut(&mut self) -> &mut $parent {
                &mut self.base
            }
        }
    };
    (@default $type:ty) => { <$type>::default() };
    (@default $type:ty, $default:expr) => { $default };
    (@parent) => { None };
    (@parent $parent:ident) => { Some(<$parent as $crate::lmcp::Struct>::TYPE) };
    (@base & $self:ident) => { None };
    (@base & $self:ident, $parent:ident) => { Some(&$self.base) };
    (@base &mut $self:ident) => { None };
    (@base &mut $self:ident, $parent:ident) => { Some(&mut $self.base) };
}
