//! What has a body: structures, unions, enumerations, bitmasks.

use super::annotation::{Annotations, hashed};
use super::constant::Constant;
use super::lexer::Token;
use super::parser::{Parsed, Parser};
use super::scope::joined;
use crate::description::{Bitmask, Case, Definition, Enumeration, Member, Structure, Type, Union};

type Place = (String, usize);

/// How the members of a type get their ids.
struct Ids {
    next: u32,
    hashed: bool,
}

impl Ids {
    /// The id of a member; the next one counts on from it.
    fn of(&mut self, name: &str, annotations: &Annotations) -> u32 {
        let given = annotations.id.as_ref().map(|id| id.of(name));
        let id = given.unwrap_or_else(|| if self.hashed { hashed(name) } else { self.next });
        self.next = id.saturating_add(1);
        id
    }
}

impl Parser<'_> {
    pub(super) fn structure(&mut self, annotations: &Annotations, place: Place) -> Parsed<()> {
        let name = self.word()?;
        self.announce(&name, &place);
        if self.takes(';') {
            return Ok(());
        }
        let base = if self.takes(':') { Some(self.base()?) } else { None };
        let extensibility = annotations.extensibility.unwrap_or(self.default);
        let next = base.as_deref().map_or(0, |base| self.ids_of(base));
        let mut ids = Ids { next, hashed: annotations.ids_are_hashes };
        self.expect('{')?;
        let mut members = Vec::new();
        while !self.takes('}') {
            let annotations = self.annotations()?;
            let held = self.type_of()?;
            loop {
                let (name, held) = self.declarator(held.clone())?;
                let member = Member::new(ids.of(&name, &annotations), name, held);
                let Annotations { key, optional, must_understand, .. } = annotations;
                members.push(Member { key, optional, must_understand, ..member });
                if !self.takes(',') {
                    break;
                }
            }
            self.expect(';')?;
        }
        self.expect(';')?;
        self.annotated_topic(&name, annotations, &place);
        self.define(&name, Definition::Structure(Structure { extensibility, base, members }), place)
    }

    /// Says that a type will be declared, so that it can hold sequences of itself.
    fn announce(&mut self, name: &str, place: &Place) {
        let full = joined(&self.scope, name);
        if self.scopes.draft.get(&full).is_none() {
            self.scopes.announced.insert(full, place.clone());
        }
    }

    fn base(&mut self) -> Parsed<String> {
        let name = self.scoped_name()?;
        let known = self.scopes.type_name(&self.scope, &name);
        known.ok_or_else(|| self.error(format!("no structure `{name}` is known: define it before")))
    }

    /// The id after those of a structure and all that it inherits from.
    fn ids_of(&self, base: &str) -> u32 {
        let mut next = 0;
        let mut name = Some(base.to_owned());
        // A chain of bases is as long as there are structures, since each is defined before it is named.
        while let Some(Definition::Structure(structure)) = name.and_then(|name| self.scopes.draft.get(&name))
        {
            next = structure.members.iter().map(|member| member.id.saturating_add(1)).fold(next, u32::max);
            name = structure.base.clone();
        }
        next
    }

    fn declarator(&mut self, held: Type) -> Parsed<(String, Type)> {
        let name = self.word()?;
        Ok((name, self.dimensions(held)?))
    }

    pub(super) fn union(&mut self, annotations: &Annotations, place: Place) -> Parsed<()> {
        let name = self.word()?;
        self.announce(&name, &place);
        if self.takes(';') {
            return Ok(());
        }
        if !self.takes_word("switch") {
            return Err(self.unexpected("`switch`"));
        }
        self.expect('(')?;
        let key = self.annotations()?.key;
        let discriminator = self.type_of()?;
        self.expect(')')?;
        self.expect('{')?;
        let mut ids = Ids { next: 1, hashed: annotations.ids_are_hashes };
        let mut cases = Vec::new();
        while !self.takes('}') {
            cases.push(self.case(&discriminator, &mut ids)?);
        }
        self.expect(';')?;
        let extensibility = annotations.extensibility.unwrap_or(self.default);
        self.define(&name, Definition::Union(Union { extensibility, discriminator, key, cases }), place)
    }

    fn case(&mut self, discriminator: &Type, ids: &mut Ids) -> Parsed<Case> {
        let (mut labels, mut default) = (Vec::new(), false);
        loop {
            if self.takes_word("default") {
                default = true;
            } else if self.takes_word("case") {
                labels.push(self.label(discriminator)?);
            } else {
                break;
            }
            self.expect(':')?;
        }
        let annotations = self.annotations()?;
        let held = self.type_of()?;
        let (name, held) = self.declarator(held)?;
        self.expect(';')?;
        let member = Member::new(ids.of(&name, &annotations), name, held);
        Ok(Case { labels, default, member })
    }

    /// A label. Of an enumeration it is one of its values by its name, in whatever scope that stands.
    fn label(&mut self, discriminator: &Type) -> Parsed<i64> {
        if let (Type::Named(name), Some(Token::Word(_) | Token::Scope)) = (discriminator, self.peek(0))
            && let Some(Definition::Enumeration(known)) = self.unaliased(name)
        {
            let literals = known.literals.clone();
            let name = self.scoped_name()?;
            let last = name.rsplit("::").next().unwrap_or_default();
            let found = literals.iter().find(|(literal, _)| literal == last);
            return found
                .map(|(_, value)| (*value).into())
                .ok_or_else(|| self.error(format!("`{name}` is no value of the discriminator")));
        }
        match self.constant()? {
            Constant::Integer(value) => i64::try_from(value)
                .or_else(|_| u64::try_from(value).map(|value| value as i64))
                .map_err(|_| self.error(format!("the label {value} does not fit in 64 bits"))),
            Constant::Boolean(value) => Ok(value.into()),
            Constant::Character(unit) => Ok(u32::from(unit).into()),
            _ => {
                Err(self
                    .error("a label is a whole number, a boolean, a character or a value of an enumeration"))
            }
        }
    }

    fn unaliased(&self, name: &str) -> Option<&Definition> {
        let mut definition = self.scopes.draft.get(name)?;
        // Each other name was defined after what it stands for, so that this ends.
        while let Definition::Alias(Type::Named(other)) = definition {
            definition = self.scopes.draft.get(other)?;
        }
        Some(definition)
    }

    pub(super) fn enumeration(&mut self, annotations: &Annotations, place: Place) -> Parsed<()> {
        let name = self.word()?;
        self.expect('{')?;
        let (mut literals, mut default, mut next) = (Vec::new(), None, 0_i128);
        while !self.takes('}') {
            let marks = self.annotations()?;
            let literal = self.word()?;
            let given = if self.takes('=') { Some(self.integer()?) } else { marks.value };
            let value = given.unwrap_or(next);
            let value = i32::try_from(value).map_err(|_| {
                self.error(format!("the value {value} of `{literal}` does not fit in 32 bits"))
            })?;
            next = i128::from(value) + 1;
            if marks.default_literal {
                default = Some(value);
            }
            let number = Constant::Integer(value.into());
            // A value is a constant of the scope around the enumeration; some write it with the enumeration's name.
            self.scopes.constants.insert(joined(&self.scope, &format!("{name}::{literal}")), number.clone());
            self.scopes.constants.insert(joined(&self.scope, &literal), number);
            literals.push((literal, value));
            if !self.takes(',') {
                self.expect('}')?;
                break;
            }
        }
        self.expect(';')?;
        let bit_bound = annotations.bit_bound.unwrap_or(32);
        let extensibility = annotations.extensibility.unwrap_or(self.default);
        let enumeration = Enumeration { bit_bound, extensibility, literals, default };
        self.define(&name, Definition::Enumeration(enumeration), place)
    }

    pub(super) fn bitmask(&mut self, annotations: &Annotations, place: Place) -> Parsed<()> {
        let name = self.word()?;
        self.expect('{')?;
        let (mut flags, mut next) = (Vec::new(), 0_u16);
        while !self.takes('}') {
            let marks = self.annotations()?;
            let flag = self.word()?;
            let position = marks.position.unwrap_or(next);
            next = position.saturating_add(1);
            flags.push((flag, position));
            if !self.takes(',') {
                self.expect('}')?;
                break;
            }
        }
        self.expect(';')?;
        let bit_bound = annotations.bit_bound.unwrap_or(32);
        let extensibility = annotations.extensibility.unwrap_or(self.default);
        self.define(&name, Definition::Bitmask(Bitmask { bit_bound, extensibility, flags }), place)
    }
}
