//! Types as Cyclone DDS wants them, made at run time from descriptions.

use crate::error::{DdsError, check, text};
use crate::participant::Participant;
use aldis_envelope::description::{Definition, Extensibility, Library, Member, Type};
use cyclors::*;
use std::collections::BTreeMap;
use std::ffi::CString;

/// A type under construction or done. It holds one reference, which the type that takes it as a part takes over.
struct Held(dds_dynamic_type_t);

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: `Held` owns one reference to a type that was created without an error.
        unsafe { dds_dynamic_type_unref(&mut self.0) };
    }
}

impl Held {
    /// Gives the reference to a call that takes it over.
    fn give(self) -> dds_dynamic_type_t {
        let given = self.0;
        std::mem::forget(self);
        given
    }

    /// One more reference, to the complete type alone: what takes it as a part does not take its minimal twin over.
    fn again(&self) -> Result<Self, DdsError> {
        let mut complete = self.0;
        complete.x[1] = std::ptr::null_mut();
        // SAFETY: the type is alive, since this reference is.
        let other = unsafe { dds_dynamic_type_ref(&mut complete) };
        check("dds_dynamic_type_ref", || "a type".into(), other.ret)?;
        Ok(Self(other))
    }
}

/// Information about a type, as peers compare it.
pub(crate) struct Registered(pub(crate) *mut ddsi_typeinfo);

// SAFETY: type information is plain data that nobody changes once it is made.
unsafe impl Send for Registered {}
// SAFETY: as above.
unsafe impl Sync for Registered {}

impl Drop for Registered {
    fn drop(&mut self) {
        // SAFETY: the pointer was made by `dds_dynamic_type_register` or `ddsi_typeinfo_dup`, whose result belongs to the caller.
        unsafe { dds_free_typeinfo(self.0) };
    }
}

/// A type with what is known of it. The domain forgets types that nobody holds, so it is held until a topic does.
pub(crate) struct Whole {
    pub(crate) information: Registered,
    _type: Held,
}

/// Makes types in the type library of a participant's domain.
pub(crate) struct Builder<'a> {
    participant: &'a Participant,
    library: &'a Library,
    /// Overrides what the description says, for a peer that has the same types otherwise.
    extensibility: Option<Extensibility>,
    /// Types that are whole, with what is known of them. A part that is whole is the library's and can be shared; one that is not is
    /// taken apart by the first type that takes it, where an equal one is known already.
    done: BTreeMap<&'a str, (Held, Registered)>,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(
        participant: &'a Participant,
        library: &'a Library,
        extensibility: Option<Extensibility>,
    ) -> Self {
        Self { participant, library, extensibility, done: BTreeMap::new() }
    }

    /// Makes a type with all that it needs, and registers it.
    pub(crate) fn register(mut self, name: &'a str) -> Result<Whole, DdsError> {
        let library = self.library;
        let Some((name, _)) = library.definitions().find(|(known, _)| *known == name) else {
            return Err(DdsError::new("dds_dynamic_type_create", name, "it is not described"));
        };
        for needed in library.needed_by(name) {
            if let Some(definition) = library.get(needed) {
                let mut held = self.define(needed, definition, needed == name)?;
                let mut info = std::ptr::null_mut();
                // SAFETY: the type is under construction, and the place of the information lives on this stack.
                let code = unsafe { dds_dynamic_type_register(&mut held.0, &mut info) };
                check("dds_dynamic_type_register", || needed.to_owned(), code)?;
                self.done.insert(needed, (held, Registered(info)));
            }
        }
        match self.done.remove(name) {
            Some((held, information)) => Ok(Whole { information, _type: held }),
            None => Err(DdsError::new("dds_dynamic_type_create", name, "it is not described")),
        }
    }

    fn define(&mut self, name: &'a str, definition: &'a Definition, top: bool) -> Result<Held, DdsError> {
        match definition {
            Definition::Alias(other) => {
                let other = self.spec(other)?;
                self.create(name, descriptor(dds_dynamic_type_kind_DDS_DYNAMIC_ALIAS), |d| {
                    d.base_type = other
                })
            }
            Definition::Enumeration(e) => {
                let mut held =
                    self.create(name, descriptor(dds_dynamic_type_kind_DDS_DYNAMIC_ENUMERATION), |_| ())?;
                self.extensible(name, &mut held, e.extensibility)?;
                bits(name, &mut held, e.bit_bound)?;
                for (literal, value) in &e.literals {
                    let c_name = text("dds_dynamic_type_add_enum_literal", literal)?;
                    let kind = dds_dynamic_type_enum_value_kind_DDS_DYNAMIC_ENUM_LITERAL_VALUE_EXPLICIT;
                    let given = dds_dynamic_enum_literal_value_t { value_kind: kind, value: *value };
                    let is_default = e.default == Some(*value);
                    // SAFETY: the type is an enumeration under construction; the name has a terminator and is copied.
                    let code = unsafe {
                        dds_dynamic_type_add_enum_literal(&mut held.0, c_name.as_ptr(), given, is_default)
                    };
                    check("dds_dynamic_type_add_enum_literal", || format!("{name}::{literal}"), code)?;
                }
                Ok(held)
            }
            Definition::Bitmask(b) => {
                let mut held =
                    self.create(name, descriptor(dds_dynamic_type_kind_DDS_DYNAMIC_BITMASK), |_| ())?;
                self.extensible(name, &mut held, b.extensibility)?;
                bits(name, &mut held, b.bit_bound)?;
                for (flag, place) in &b.flags {
                    let c_name = text("dds_dynamic_type_add_bitmask_field", flag)?;
                    // SAFETY: the type is a bitmask under construction; the name has a terminator and is copied.
                    let code =
                        unsafe { dds_dynamic_type_add_bitmask_field(&mut held.0, c_name.as_ptr(), *place) };
                    check("dds_dynamic_type_add_bitmask_field", || format!("{name}::{flag}"), code)?;
                }
                Ok(held)
            }
            Definition::Structure(structure) => {
                // Cyclone's dynamic types inherit nothing: inherited members are given as own ones, which have the same bytes.
                let kind = dds_dynamic_type_kind_DDS_DYNAMIC_STRUCTURE;
                let mut held = self.create(name, descriptor(kind), |_| ())?;
                self.extensible(name, &mut held, structure.extensibility)?;
                nested(name, &mut held, !top)?;
                for member in self.library.members(structure) {
                    self.member(name, &mut held, member)?;
                }
                Ok(held)
            }
            Definition::Union(union) => {
                let discriminator = self.spec(&union.discriminator)?;
                let kind = dds_dynamic_type_kind_DDS_DYNAMIC_UNION;
                let mut held =
                    self.create(name, descriptor(kind), |d| d.discriminator_type = discriminator)?;
                self.extensible(name, &mut held, union.extensibility)?;
                nested(name, &mut held, !top)?;
                for case in &union.cases {
                    let mut labels: Vec<i32> = case.labels.iter().map(|label| *label as i32).collect();
                    self.add(name, &mut held, &case.member, &mut labels, case.default)?;
                }
                Ok(held)
            }
        }
    }

    fn member(&mut self, name: &str, held: &mut Held, member: &'a Member) -> Result<(), DdsError> {
        self.add(name, held, member, &mut [], false)?;
        let what = || format!("{name}::{}", member.name);
        // SAFETY: the type is a structure under construction, and the member was added by this id.
        unsafe {
            if member.key {
                check(
                    "dds_dynamic_member_set_key",
                    what,
                    dds_dynamic_member_set_key(&mut held.0, member.id, true),
                )?;
            }
            if member.optional {
                let code = dds_dynamic_member_set_optional(&mut held.0, member.id, true);
                check("dds_dynamic_member_set_optional", what, code)?;
            }
            if member.must_understand && !member.key {
                let code = dds_dynamic_member_set_must_understand(&mut held.0, member.id, true);
                check("dds_dynamic_member_set_must_understand", what, code)?;
            }
        }
        Ok(())
    }

    fn add(
        &mut self,
        name: &str,
        held: &mut Held,
        member: &'a Member,
        labels: &mut [i32],
        default_label: bool,
    ) -> Result<(), DdsError> {
        const CALL: &str = "dds_dynamic_type_add_member";
        let c_name = text(CALL, &member.name)?;
        let given = dds_dynamic_member_descriptor_t {
            name: c_name.as_ptr(),
            id: member.id,
            type_: self.spec(&member.r#type)?,
            default_value: std::ptr::null_mut(),
            index: u32::MAX,
            num_labels: labels.len() as u32,
            labels: labels.as_mut_ptr(),
            default_label,
        };
        // SAFETY: the type is under construction; name and labels outlive the call, which copies them and takes over the
        // reference to the member's type, also where it fails.
        let code = unsafe { dds_dynamic_type_add_member(&mut held.0, given) };
        check(CALL, || format!("{name}::{}", member.name), code).map(drop)
    }

    fn extensible(&self, name: &str, held: &mut Held, described: Extensibility) -> Result<(), DdsError> {
        let kind = match self.extensibility.unwrap_or(described) {
            Extensibility::Final => dds_dynamic_type_extensibility_DDS_DYNAMIC_TYPE_EXT_FINAL,
            Extensibility::Appendable => dds_dynamic_type_extensibility_DDS_DYNAMIC_TYPE_EXT_APPENDABLE,
            Extensibility::Mutable => dds_dynamic_type_extensibility_DDS_DYNAMIC_TYPE_EXT_MUTABLE,
        };
        // SAFETY: the type is under construction and has no members yet.
        let code = unsafe { dds_dynamic_type_set_extensibility(&mut held.0, kind) };
        check("dds_dynamic_type_set_extensibility", || name.to_owned(), code).map(drop)
    }

    /// A type as a part of another. The reference in it is taken over by the call that it is given to.
    fn spec(&mut self, r#type: &'a Type) -> Result<dds_dynamic_type_spec_t, DdsError> {
        if let Some(primitive) = primitive(r#type) {
            let type_ = dds_dynamic_type_spec__bindgen_ty_1 { primitive };
            return Ok(dds_dynamic_type_spec_t {
                kind: dds_dynamic_type_spec_kind_DDS_DYNAMIC_TYPE_KIND_PRIMITIVE,
                type_,
            });
        }
        let held = match r#type {
            Type::Named(name) => match self.done.get(name.as_str()) {
                Some((done, _)) => done.again()?,
                None => {
                    let cause = "it holds itself, which Cyclone's run-time types cannot";
                    return Err(DdsError::new("dds_dynamic_type_create", name, cause));
                }
            },
            Type::String { bound } => {
                self.bounded("string", dds_dynamic_type_kind_DDS_DYNAMIC_STRING8, None, bound.as_slice())?
            }
            Type::WideString { bound } => {
                self.bounded("wstring", dds_dynamic_type_kind_DDS_DYNAMIC_STRING16, None, bound.as_slice())?
            }
            Type::Sequence { element, bound } => {
                let element = self.spec(element)?;
                let kind = dds_dynamic_type_kind_DDS_DYNAMIC_SEQUENCE;
                self.bounded("sequence", kind, Some(element), bound.as_slice())?
            }
            Type::Array { element, dimensions } => {
                let element = self.spec(element)?;
                self.bounded("array", dds_dynamic_type_kind_DDS_DYNAMIC_ARRAY, Some(element), dimensions)?
            }
            _ => return Err(DdsError::new("dds_dynamic_type_create", format!("{type:?}"), "not supported")),
        };
        Ok(dds_dynamic_type_spec_t {
            kind: dds_dynamic_type_spec_kind_DDS_DYNAMIC_TYPE_KIND_DEFINITION,
            type_: dds_dynamic_type_spec__bindgen_ty_1 { type_: held.give() },
        })
    }

    fn bounded(
        &self,
        name: &str,
        kind: dds_dynamic_type_kind_t,
        element: Option<dds_dynamic_type_spec_t>,
        bounds: &[u32],
    ) -> Result<Held, DdsError> {
        self.create(name, descriptor(kind), |d| {
            d.num_bounds = bounds.len() as u32;
            d.bounds = bounds.as_ptr();
            if let Some(element) = element {
                d.element_type = element;
            }
        })
    }

    /// Creates a type. It always has a name: without one, arrays and strings make Cyclone DDS crash.
    fn create(
        &self,
        name: &str,
        mut given: dds_dynamic_type_descriptor_t,
        with: impl FnOnce(&mut dds_dynamic_type_descriptor_t),
    ) -> Result<Held, DdsError> {
        const CALL: &str = "dds_dynamic_type_create";
        let c_name: CString = text(CALL, name)?;
        given.name = c_name.as_ptr();
        with(&mut given);
        // SAFETY: name and bounds outlive the call, which copies them; the references to other types in the descriptor are taken
        // over by it; all else in it is zero, which is "none" throughout.
        let made = unsafe { dds_dynamic_type_create(self.participant.entity().0, given) };
        check(CALL, || name.to_owned(), made.ret)?;
        Ok(Held(made))
    }
}

fn descriptor(kind: dds_dynamic_type_kind_t) -> dds_dynamic_type_descriptor_t {
    // SAFETY: all fields are numbers and pointers, for which zero is valid and means "none".
    let mut given: dds_dynamic_type_descriptor_t = unsafe { std::mem::zeroed() };
    given.kind = kind;
    given
}

fn bits(name: &str, held: &mut Held, bound: u16) -> Result<(), DdsError> {
    // SAFETY: the type is an enumeration or a bitmask under construction without members.
    let code = unsafe { dds_dynamic_type_set_bit_bound(&mut held.0, bound) };
    check("dds_dynamic_type_set_bit_bound", || name.to_owned(), code).map(drop)
}

fn nested(name: &str, held: &mut Held, nested: bool) -> Result<(), DdsError> {
    // SAFETY: the type is a structure or a union under construction without members.
    let code = unsafe { dds_dynamic_type_set_nested(&mut held.0, nested) };
    check("dds_dynamic_type_set_nested", || name.to_owned(), code).map(drop)
}

fn primitive(r#type: &Type) -> Option<dds_dynamic_type_kind_t> {
    Some(match r#type {
        Type::Boolean => dds_dynamic_type_kind_DDS_DYNAMIC_BOOLEAN,
        Type::Octet => dds_dynamic_type_kind_DDS_DYNAMIC_BYTE,
        Type::Char8 => dds_dynamic_type_kind_DDS_DYNAMIC_CHAR8,
        Type::Char16 => dds_dynamic_type_kind_DDS_DYNAMIC_CHAR16,
        Type::Int8 => dds_dynamic_type_kind_DDS_DYNAMIC_INT8,
        Type::UInt8 => dds_dynamic_type_kind_DDS_DYNAMIC_UINT8,
        Type::Int16 => dds_dynamic_type_kind_DDS_DYNAMIC_INT16,
        Type::UInt16 => dds_dynamic_type_kind_DDS_DYNAMIC_UINT16,
        Type::Int32 => dds_dynamic_type_kind_DDS_DYNAMIC_INT32,
        Type::UInt32 => dds_dynamic_type_kind_DDS_DYNAMIC_UINT32,
        Type::Int64 => dds_dynamic_type_kind_DDS_DYNAMIC_INT64,
        Type::UInt64 => dds_dynamic_type_kind_DDS_DYNAMIC_UINT64,
        Type::Float32 => dds_dynamic_type_kind_DDS_DYNAMIC_FLOAT32,
        Type::Float64 => dds_dynamic_type_kind_DDS_DYNAMIC_FLOAT64,
        _ => return None,
    })
}
