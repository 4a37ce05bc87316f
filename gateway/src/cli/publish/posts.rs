//! What is to be published: from text, a file, or LMCP objects in XML or JSON.

use super::super::content::{descriptor, read_file};
use super::super::exit::Failure;
use super::super::lmcp::{objects_of_json, objects_of_xml};
use super::{Content, Publish};
use aldis_envelope::lmcp::{self, Object};
use aldis_envelope::{Address, ContentType, Descriptor, Instance};
use bytes::Bytes;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// One message to be published.
pub(super) struct Post {
    pub(super) address: Address,
    pub(super) content_type: ContentType,
    pub(super) descriptor: Descriptor,
    pub(super) instance: Option<Arc<Instance>>,
    pub(super) content: Bytes,
    /// When it goes out, counted from the start of a round.
    pub(super) after: Duration,
}

/// When the last one goes out.
pub(super) fn total_span(posts: &[Post]) -> Duration {
    posts.iter().map(|post| post.after).max().unwrap_or_default()
}

impl Publish {
    /// The messages of one round, in the order in which they go out.
    pub(super) fn posts(&self) -> Result<Vec<Post>, Failure> {
        match &self.content {
            Content { lmcp_xml: Some(path), .. } => {
                let placed = objects_of_xml(path, &read_file(path)?)?;
                let mut posts = Vec::new();
                for placed in placed {
                    let after = if self.timed { placed.time } else { None };
                    let after = Duration::try_from_secs_f64(after.unwrap_or_default()).map_err(|why| {
                        Failure::Failed(format!("{}: line {}: Time: {why}", path.display(), placed.line))
                    })?;
                    posts.push(Post { after, ..self.object(path, placed.object.as_ref())? });
                }
                posts.sort_by_key(|post| post.after);
                Ok(posts)
            }
            Content { lmcp_json: Some(path), .. } => {
                let objects = objects_of_json(path, &read_file(path)?)?;
                objects.iter().map(|object| self.object(path, object.as_ref())).collect()
            }
            Content { file: Some(file), .. } => Ok(vec![self.content(read_file(file)?)?]),
            Content { text, .. } => Ok(vec![self.content(Bytes::from(text.clone().unwrap_or_default()))?]),
        }
    }

    /// A content as it is, described on the command line.
    fn content(&self, content: Bytes) -> Result<Post, Failure> {
        let missing = || Failure::Usage("a content needs an address".into());
        let address = self.address.clone().ok_or_else(missing)?;
        let named = || descriptor(&address.to_string()).map_err(Failure::Usage);
        let descriptor = self.descriptor.clone().map_or_else(named, Ok)?;
        let content_type = self.content_type.clone();
        Ok(Post { address, content_type, descriptor, instance: None, content, after: Duration::ZERO })
    }

    /// An LMCP object, described by itself.
    fn object(&self, path: &Path, object: &dyn Object) -> Result<Post, Failure> {
        let failed = |why: &dyn std::fmt::Display| {
            Failure::Failed(format!("{}: {}: {why}", path.display(), object.type_info()))
        };
        let name = object.type_info().full_name;
        let content = lmcp::encode(object).map_err(|why| failed(&why))?;
        let own = || Address::new(name).map_err(|why| failed(&why));
        Ok(Post {
            address: self.address.clone().map_or_else(own, Ok)?,
            content_type: ContentType::Lmcp,
            descriptor: descriptor(name).map_err(|why| failed(&why))?,
            instance: lmcp::natural_key(name, &content).map(|key| Arc::new(Instance::of_number(key))),
            content: content.into(),
            after: Duration::ZERO,
        })
    }
}
