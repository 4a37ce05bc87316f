//! The entities that a node speaks for, and those that may administer it.

use super::cure::cured;
use super::schema;
use aldis_envelope::EntityId;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The entities that a node speaks for: its own first, at least one, none twice.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Vec<EntityId>", into = "Vec<EntityId>")]
#[schemars(with = "schema::EntityIds")]
pub(crate) struct Entities {
    own: EntityId,
    others: Vec<EntityId>,
}

impl Entities {
    /// The node's own entity.
    pub(crate) fn own(&self) -> EntityId {
        self.own
    }

    /// All entities, the own one first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = EntityId> + '_ {
        std::iter::once(self.own).chain(self.others.iter().copied())
    }

    /// Whether the node speaks for an entity.
    pub(crate) fn contains(&self, entity: EntityId) -> bool {
        self.iter().any(|e| e == entity)
    }
}

impl TryFrom<Vec<EntityId>> for Entities {
    type Error = String;

    fn try_from(all: Vec<EntityId>) -> Result<Self, String> {
        without_duplicates("entities", &all)?;
        match all.split_first() {
            Some((own, others)) => Ok(Self { own: *own, others: others.to_vec() }),
            None => {
                Err(cured("`entities` is empty", "name at least the node's own entity: entities = [400]"))
            }
        }
    }
}

impl From<Entities> for Vec<EntityId> {
    fn from(entities: Entities) -> Self {
        entities.iter().collect()
    }
}

/// Entities that may administer nodes, besides each node's own. None twice; none at all by default.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Vec<EntityId>", into = "Vec<EntityId>")]
#[schemars(with = "schema::OperatorIds")]
pub(crate) struct Operators(Vec<EntityId>);

impl Operators {
    /// All operators, in the order of the file.
    pub(crate) fn iter(&self) -> impl Iterator<Item = EntityId> + '_ {
        self.0.iter().copied()
    }
}

impl TryFrom<Vec<EntityId>> for Operators {
    type Error = String;

    fn try_from(all: Vec<EntityId>) -> Result<Self, String> {
        without_duplicates("operators", &all)?;
        Ok(Self(all))
    }
}

impl From<Operators> for Vec<EntityId> {
    fn from(operators: Operators) -> Self {
        operators.0
    }
}

fn without_duplicates(key: &str, all: &[EntityId]) -> Result<(), String> {
    let twice = all.iter().enumerate().find(|(i, entity)| all[..*i].contains(entity));
    match twice {
        None => Ok(()),
        Some((_, entity)) => {
            Err(cured(format_args!("`{key}` names entity {entity} twice"), "leave one of the two out"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(numbers: &[u64]) -> Vec<EntityId> {
        numbers.iter().map(|n| EntityId::new(*n).unwrap()).collect()
    }

    #[test]
    fn the_own_entity_comes_first_and_none_twice() {
        let entities = Entities::try_from(ids(&[400, 100])).unwrap();
        assert_eq!(entities.own().get(), 400);
        assert!(entities.contains(EntityId::new(100).unwrap()));
        assert_eq!(Vec::from(entities), ids(&[400, 100]));
        assert!(Entities::try_from(ids(&[])).is_err());
        assert!(Entities::try_from(ids(&[400, 100, 400])).unwrap_err().contains("400 twice"));
        assert!(Operators::try_from(ids(&[])).is_ok());
        assert!(Operators::try_from(ids(&[1, 1])).is_err());
    }
}
