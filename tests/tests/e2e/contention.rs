//! Consumers that contend for the providers of one resource, in processes of their own, of which one is killed. A thousand
//! allocations with a kill of every process are `aldis bench contention`.

use aldis_tests::aldis;

#[test]
fn contended_control_is_never_given_twice_and_survives_a_kill() {
    let done = aldis(["bench", "contention", "--allocations", "30", "--kills", "1", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let result = &done.json()[0];
    let counted = |name: &str| result[name].as_u64().unwrap();
    for wrong in
        ["two_holders", "executed_without_control", "kills_not_right_within_the_lease", "clauses_broken"]
    {
        assert_eq!(counted(wrong), 0, "{wrong}: {result}");
    }
    // What must not be could have been.
    assert!(counted("allocations") >= 30, "{result}");
    for seen in ["refused", "taken_over", "commands_executed", "commands_without_control"] {
        assert!(counted(seen) > 0, "{seen}: {result}");
    }
    assert_eq!(result["kills"][0]["process"], "arbiter", "{result}");
    assert!(result["left"].as_array().unwrap().is_empty(), "{result}");
}
