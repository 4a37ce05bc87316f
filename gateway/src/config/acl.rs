//! The access control of the fleet's routers, from the configurations of its nodes.
//!
//! Denied is what no rule allows. A node may send only as its own entities: whatever it puts, deletes, answers or
//! declares itself alive with has one of them as source in the key. It may read everything of its fleet. So a
//! receiver can believe the source in a key, because the router does not pass on any other.
//!
//! A node is known to the router by `bus.user` (`name` where it has none) and its password, or, with `enable_mtls`
//! and a `connect_certificate`, by the common name of that certificate, which must be `name`; one that has both must
//! show both. An entity of `operators` that no configuration speaks for is the user whose name is its number: the
//! command line joins as `9000`. An operator with another user name or a certificate has a configuration of its own,
//! given to `acl` with the others.

use super::Config;
use aldis_envelope::{EntityId, Fleet, Keys};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The spaces beside the data, each followed by the source's entity. No wildcard of Zenoh matches an `@` chunk, so
/// that each is named on its own. In `@alive` there are tokens alone.
const SPACES: [&str; 4] = ["@writer", "@state", "@ack", "@link"];
const ALIVE: &str = "@alive";

/// What a node does in its own name.
const SPEAKS: [&str; 4] = ["put", "delete", "reply", "declare_queryable"];
/// What a node does to hear others.
const HEARS: [&str; 4] = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"];
const TOKEN: &str = "liveliness_token";

/// Why no access control can be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum AclError {
    /// Access control without anybody in it would stop the fleet.
    #[error("access control needs the configuration of at least one node")]
    Nobody,
    /// Two nodes that the router cannot tell apart would have each other's rights.
    #[error("two nodes have the {what} `{text}`: the router cannot tell them apart; rename one")]
    Twice {
        /// What they share.
        what: &'static str,
        /// Its text.
        text: String,
    },
}

/// Zenoh's access control for a router, from the configurations of all nodes that join it. Printed, it is a Zenoh
/// configuration file: for `bus.zenoh_config` of a node in router mode, or for `zenohd`.
///
/// # Errors
/// [`AclError`] without any configuration, or when two nodes cannot be told apart.
pub(crate) fn acl(configs: &[Config]) -> Result<Value, AclError> {
    if configs.is_empty() {
        return Err(AclError::Nobody);
    }
    let mut members: Vec<Member<'_>> = configs.iter().map(Member::of).collect();
    members.extend(operators(configs));
    told_apart(&members)?;
    let fleets: BTreeSet<&Fleet> = members.iter().map(|member| member.fleet).collect();
    let common = fleets.into_iter().flat_map(common_rules);
    let rules: Vec<Value> = common.chain(members.iter().flat_map(Member::rules)).collect();
    Ok(json!({
        "access_control": {
            "enabled": true,
            "default_permission": "deny",
            "rules": rules,
            "subjects": members.iter().map(Member::subject).collect::<Vec<_>>(),
            "policies": members.iter().map(Member::policy).collect::<Vec<_>>(),
        }
    }))
}

/// Who joins the router, and as what it is known there.
struct Member<'a> {
    name: String,
    fleet: &'a Fleet,
    entities: Vec<EntityId>,
    user: Option<String>,
    certificate: Option<String>,
}

impl<'a> Member<'a> {
    fn of(config: &'a Config) -> Self {
        let name = config.name.as_str().to_owned();
        let certificate = config.bus.shows_certificate().then(|| name.clone());
        let user = match &config.bus.user {
            Some(user) => Some(user.as_str().to_owned()),
            None if certificate.is_none() => Some(name.clone()),
            None => None,
        };
        // A gateway speaks for those behind its links on its own bus.
        let behind = config.links.iter().flat_map(super::Link::behind);
        let entities = config.entities.iter().chain(behind).collect();
        Self { name, fleet: &config.fleet, entities, user, certificate }
    }

    fn operator(fleet: &'a Fleet, entity: EntityId) -> Self {
        let user = Some(entity.to_string());
        Self { name: format!("operator {entity}"), fleet, entities: vec![entity], user, certificate: None }
    }

    /// Zenoh asks for all properties that a subject names.
    fn subject(&self) -> Value {
        let mut subject = json!({ "id": self.name });
        if let Some(user) = &self.user {
            subject["usernames"] = json!([user]);
        }
        if let Some(certificate) = &self.certificate {
            subject["cert_common_names"] = json!([certificate]);
        }
        subject
    }

    /// One rule for each plane: the data, the four spaces beside it, and the tokens.
    fn rules(&self) -> Vec<Value> {
        let keys = Keys::new(self.fleet);
        let below = |space: &str| self.entities.iter().map(|e| keys.of_entity(space, *e)).collect::<Vec<_>>();
        let mut rules = vec![rule(&self.plane("data"), "ingress", &SPEAKS, &below(""))];
        for space in SPACES {
            rules.push(rule(&self.plane(space), "ingress", &SPEAKS, &below(space)));
        }
        rules.push(rule(&self.plane(ALIVE), "ingress", &[TOKEN], &below(ALIVE)));
        rules
    }

    fn policy(&self) -> Value {
        let fleet = self.fleet;
        let mut rules = vec![format!("{fleet} reads"), format!("{fleet} is told"), self.plane("data")];
        rules.extend(SPACES.map(|space| self.plane(space)));
        rules.push(self.plane(ALIVE));
        json!({ "id": self.name, "rules": rules, "subjects": [self.name] })
    }

    /// The name of a rule. No name has a space in it, so that none is meant twice.
    fn plane(&self, space: &str) -> String {
        format!("{} speaks in {space}", self.name)
    }
}

/// Operators that no configuration speaks for, once in each fleet.
fn operators(configs: &[Config]) -> Vec<Member<'_>> {
    let spoken_for: BTreeSet<(&Fleet, EntityId)> =
        configs.iter().flat_map(|c| c.entities.iter().map(move |entity| (&c.fleet, entity))).collect();
    let operators: BTreeSet<(&Fleet, EntityId)> =
        configs.iter().flat_map(|c| c.operators.iter().map(move |entity| (&c.fleet, entity))).collect();
    operators.difference(&spoken_for).map(|(fleet, entity)| Member::operator(fleet, *entity)).collect()
}

/// Every member of a fleet reads all of it, and the router tells it all that it reads.
fn common_rules(fleet: &Fleet) -> [Value; 2] {
    let data = Keys::new(fleet).everything();
    let root = data.trim_end_matches("**");
    let spaces = SPACES.iter().chain([&ALIVE]).map(|space| format!("{root}{space}/**"));
    let everything: Vec<String> = std::iter::once(data.clone()).chain(spaces).collect();
    let told = [&SPEAKS[..], &HEARS[..], &[TOKEN]].concat();
    [
        rule(&format!("{fleet} reads"), "ingress", &HEARS, &everything),
        rule(&format!("{fleet} is told"), "egress", &told, &everything),
    ]
}

fn rule(id: &str, flow: &str, messages: &[&str], key_exprs: &[String]) -> Value {
    json!({ "id": id, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": key_exprs })
}

fn told_apart(members: &[Member<'_>]) -> Result<(), AclError> {
    let mut seen = BTreeMap::new();
    for member in members {
        let marks = [
            ("name", Some(&member.name)),
            ("user", member.user.as_ref()),
            ("certificate", member.certificate.as_ref()),
        ];
        for (what, text) in marks {
            let Some(text) = text else { continue };
            if seen.insert((what, text), ()).is_some() {
                return Err(AclError::Twice { what, text: text.clone() });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
