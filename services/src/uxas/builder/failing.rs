//! Requests without a plan: who asked without a validator of ours learns the cause too.

use super::Builder;
use crate::uxas::machine::{FAILED_KEY, Post, REQUEST_KEY, pair};
use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AutomationResponse, KeyValuePair, ServiceStatus, ServiceStatusType};
use aldis_envelope::lmcp::uxtask::UniqueAutomationResponse;

impl Builder {
    /// Ends a request with a cause of its own.
    pub(super) fn fail(&mut self, number: i64, why: &str, post: &mut Post<'_>) {
        self.speeds.remove(&number);
        post.failed(number, why);
        answer(number, vec![pair(FAILED_KEY, why)], post);
    }

    /// Ends a request that another service says has failed.
    pub(super) fn status(&mut self, status: &ServiceStatus, post: &mut Post<'_>) {
        let pairs: Vec<_> = status.info.iter().filter_map(|one| one.get()).collect();
        let failed =
            status.status_type == ServiceStatusType::Error && pairs.iter().any(|pair| pair.key == FAILED_KEY);
        let number =
            pairs.iter().find(|pair| pair.key == REQUEST_KEY).and_then(|pair| pair.value.parse::<i64>().ok());
        let Some(number) = number.filter(|_| failed) else { return };
        self.speeds.remove(&number);
        let is_building = self.building.remove(&number).is_some();
        if self.requests.remove(&number).is_some() || is_building {
            let causes = pairs.iter().filter(|one| one.key != REQUEST_KEY);
            answer(number, causes.map(|one| pair(&one.key, &one.value)).collect(), post);
        }
    }
}

/// Tells that a request has no plan, in the kind in which builders answer.
fn answer(number: i64, info: Vec<Ref<KeyValuePair>>, post: &mut Post<'_>) {
    post.broadcast(&UniqueAutomationResponse {
        response_id: number,
        original_response: Ref::new(AutomationResponse { info, ..AutomationResponse::default() }),
        ..UniqueAutomationResponse::default()
    });
}
