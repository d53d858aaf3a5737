//! A learned domain without its objects: only which states hold.

use symbolt::task::domain::{NeedVerdict, RelationalDomain, RelationalOperator};
use symbolt::task::{Domain, DomainBuilder};

/// Returns the names of the states that must hold before an action, in the order of the domain.
pub fn needs<'d>(domain: &'d RelationalDomain, operator: &RelationalOperator) -> Vec<&'d str> {
    let needs = operator.needs_with(NeedVerdict::Required).map(|need| need.condition.state);
    let mut needs: Vec<usize> = operator.from.iter().copied().chain(needs).collect();
    needs.sort_unstable();
    needs.dedup();
    domain.names(&needs)
}

/// Returns a domain with the same states and actions.
#[allow(dead_code)] // Not every test program needs both.
pub fn propositional(domain: &RelationalDomain) -> Domain {
    let states = domain.states.iter().fold(DomainBuilder::new(), |b, s| b.state(&s.name));
    let all = domain.operators.iter().fold(states, |builder, operator| {
        let to = domain.states[operator.to].name.as_str();
        let absent = domain.names(&operator.never_seen);
        builder.action_unless(&operator.name, needs(domain, operator), absent, [to])
    });
    all.build().expect("a learned domain is sound")
}
