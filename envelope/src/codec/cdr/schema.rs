//! A type made ready for reading and writing: no names are looked up any more.

use super::error::SchemaError;
use crate::change::KeyWidth;
use crate::description::{Definition, Enumeration, Extensibility, Library, Member, Resolved, Type, Union};
use std::collections::BTreeMap;

/// The place of a node.
pub(super) type NodeId = usize;

/// A number, a boolean or a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Primitive {
    Boolean,
    Character,
    WideCharacter,
    Unsigned,
    Signed,
    Float,
}

#[derive(Debug, Clone)]
pub(super) enum Node {
    Primitive {
        kind: Primitive,
        size: usize,
    },
    Text {
        bound: Option<u32>,
    },
    WideText {
        bound: Option<u32>,
    },
    Enumeration(Enumeration),
    Bitmask {
        size: usize,
    },
    List(List),
    Structure(Structure),
    Union {
        extensibility: Extensibility,
        discriminator: NodeId,
        union: Union,
        cases: Vec<NodeId>,
    },
    /// Stands for a type that is being made ready.
    Open,
}

/// A sequence or an array.
#[derive(Debug, Clone)]
pub(super) struct List {
    pub(super) element: NodeId,
    /// The number of elements of an array.
    pub(super) length: Option<usize>,
    pub(super) bound: Option<u32>,
    /// Whether the elements are single octets.
    pub(super) octets: bool,
    /// Whether XCDR2 writes its length in bytes in front: where elements are no primitives.
    pub(super) delimited: bool,
}

#[derive(Debug, Clone)]
pub(super) struct Structure {
    pub(super) extensibility: Extensibility,
    pub(super) members: Vec<Field>,
}

#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) id: u32,
    pub(super) name: String,
    pub(super) node: NodeId,
    pub(super) key: bool,
    pub(super) optional: bool,
    pub(super) must_understand: bool,
}

/// A structure or union by which samples are read and written.
#[derive(Debug, Clone)]
pub struct Schema {
    pub(super) nodes: Vec<Node>,
    pub(super) root: NodeId,
    type_name: String,
    width: KeyWidth,
}

impl Schema {
    /// The schema of a type.
    ///
    /// # Errors
    /// [`SchemaError`] where the library lacks it, or it is or holds what is mutable.
    pub fn new(library: &Library, type_name: &str) -> Result<Self, SchemaError> {
        let unknown = || SchemaError::Unknown(type_name.to_owned());
        if library.structure(type_name).is_none() && library.union(type_name).is_none() {
            return Err(unknown());
        }
        let mut builder = Builder { library, nodes: Vec::new(), known: BTreeMap::new() };
        let root = builder.node(&Type::named(type_name))?;
        let width = library.key_width(type_name);
        Ok(Self { nodes: builder.nodes, root, type_name: type_name.to_owned(), width })
    }

    /// The type's name.
    pub fn type_name(&self) -> &str {
        &self.type_name
    }

    /// How the type may grow.
    pub fn extensibility(&self) -> Extensibility {
        match &self.nodes[self.root] {
            Node::Structure(structure) => structure.extensibility,
            Node::Union { extensibility, .. } => *extensibility,
            _ => Extensibility::Final,
        }
    }

    /// The same type with everything in it final: what a peer declares that takes IDL without annotations so.
    pub fn as_final(&self) -> Self {
        let mut twin = self.clone();
        for node in &mut twin.nodes {
            match node {
                Node::Structure(structure) => structure.extensibility = Extensibility::Final,
                Node::Union { extensibility, .. } => *extensibility = Extensibility::Final,
                _ => {}
            }
        }
        twin
    }

    /// Whether the type has a key.
    pub fn is_keyed(&self) -> bool {
        match &self.nodes[self.root] {
            Node::Structure(structure) => structure.members.iter().any(|field| field.key),
            _ => false,
        }
    }

    /// Whether every key of the type fits a key hash.
    pub fn key_width(&self) -> KeyWidth {
        self.width
    }

    /// The type with its key members alone, down into nested structures.
    pub(super) fn key_holder(&self) -> Self {
        let mut holder = self.clone();
        holder.keep_keys(self.root, false);
        holder
    }

    fn keep_keys(&mut self, id: NodeId, all: bool) {
        let Node::Structure(structure) = &self.nodes[id] else { return };
        let mut structure = structure.clone();
        let some = structure.members.iter().any(|field| field.key);
        structure.members.retain(|field| if some || !all { field.key } else { !field.optional });
        for field in &mut structure.members {
            // A nested structure may stand elsewhere as a whole, so the key has its own.
            if matches!(self.nodes[field.node], Node::Structure(_)) {
                let copy = self.nodes[field.node].clone();
                self.nodes.push(copy);
                field.node = self.nodes.len() - 1;
                self.keep_keys(field.node, true);
            }
        }
        self.nodes[id] = Node::Structure(structure);
    }

    /// The same with all members in the order of their ids and everything final: the form of key hashes.
    pub(super) fn normalized(&self) -> Self {
        let mut normal = self.as_final();
        for node in &mut normal.nodes {
            if let Node::Structure(structure) = node {
                structure.members.sort_by_key(|field| field.id);
            }
        }
        normal
    }
}

struct Builder<'a> {
    library: &'a Library,
    nodes: Vec<Node>,
    known: BTreeMap<&'a str, NodeId>,
}

impl<'a> Builder<'a> {
    fn push(&mut self, node: Node) -> NodeId {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn node(&mut self, r#type: &Type) -> Result<NodeId, SchemaError> {
        let library = self.library;
        let resolved = match r#type {
            Type::Named(name) => match library.entry(name) {
                Some((name, definition)) => match definition {
                    Definition::Alias(other) => library.resolved(other),
                    _ => Resolved::Defined(name, definition),
                },
                None => return Err(SchemaError::Unknown(name.clone())),
            },
            plain => return self.plain(plain),
        };
        match resolved {
            Resolved::Plain(plain) => self.plain(plain),
            Resolved::Defined(name, definition) => match self.known.get(name) {
                Some(id) => Ok(*id),
                None => {
                    let id = self.push(Node::Open);
                    self.known.insert(name, id);
                    self.nodes[id] = self.defined(name, definition)?;
                    Ok(id)
                }
            },
        }
    }

    fn defined(&mut self, name: &str, definition: &'a Definition) -> Result<Node, SchemaError> {
        Ok(match definition {
            Definition::Enumeration(enumeration) => Node::Enumeration(enumeration.clone()),
            Definition::Bitmask(bitmask) => Node::Bitmask { size: bitmask.size() },
            Definition::Structure(structure) => {
                let extensibility = not_mutable(name, structure.extensibility)?;
                let members = self.library.members(structure).into_iter();
                let members = members.map(|member| self.field(member)).collect::<Result<_, _>>()?;
                Node::Structure(Structure { extensibility, members })
            }
            Definition::Union(union) => {
                let extensibility = not_mutable(name, union.extensibility)?;
                let discriminator = self.node(&union.discriminator)?;
                let cases = union.cases.iter().map(|case| self.node(&case.member.r#type));
                let cases = cases.collect::<Result<_, _>>()?;
                Node::Union { extensibility, discriminator, union: union.clone(), cases }
            }
            Definition::Alias(_) => return Err(SchemaError::Unknown(name.to_owned())),
        })
    }

    fn field(&mut self, member: &Member) -> Result<Field, SchemaError> {
        let Member { id, key, optional, must_understand, .. } = *member;
        let node = self.node(&member.r#type)?;
        Ok(Field { id, name: member.name.clone(), node, key, optional, must_understand })
    }

    fn plain(&mut self, r#type: &Type) -> Result<NodeId, SchemaError> {
        use Primitive::{Boolean, Character, Float, Signed, Unsigned, WideCharacter};
        let kind = match r#type {
            Type::Boolean => Boolean,
            Type::Char8 => Character,
            Type::Char16 => WideCharacter,
            Type::Octet | Type::UInt8 | Type::UInt16 | Type::UInt32 | Type::UInt64 => Unsigned,
            Type::Int8 | Type::Int16 | Type::Int32 | Type::Int64 => Signed,
            Type::Float32 | Type::Float64 => Float,
            Type::String { bound } => return Ok(self.push(Node::Text { bound: *bound })),
            Type::WideString { bound } => return Ok(self.push(Node::WideText { bound: *bound })),
            Type::Sequence { element, bound } => return self.list(element, None, *bound),
            Type::Array { element, dimensions } => {
                let length = dimensions.iter().map(|length| *length as usize).product();
                return self.list(element, Some(length), None);
            }
            Type::Named(name) => return Err(SchemaError::Unknown(name.clone())),
        };
        let size = r#type.primitive_size().unwrap_or(1);
        Ok(self.push(Node::Primitive { kind, size }))
    }

    fn list(
        &mut self,
        element: &Type,
        length: Option<usize>,
        bound: Option<u32>,
    ) -> Result<NodeId, SchemaError> {
        let element = self.node(element)?;
        // Arrays of arrays are one array.
        if let (Some(length), Node::List(inner)) = (length, &self.nodes[element])
            && let Some(inner_length) = inner.length
        {
            let list = List { length: Some(length * inner_length), ..inner.clone() };
            return Ok(self.push(Node::List(list)));
        }
        let octets = matches!(self.nodes[element], Node::Primitive { kind: Primitive::Unsigned, size: 1 });
        let delimited = !matches!(self.nodes[element], Node::Primitive { .. });
        Ok(self.push(Node::List(List { element, length, bound, octets, delimited })))
    }
}

fn not_mutable(name: &str, extensibility: Extensibility) -> Result<Extensibility, SchemaError> {
    match extensibility {
        Extensibility::Mutable => Err(SchemaError::Mutable(name.to_owned())),
        extensibility => Ok(extensibility),
    }
}
