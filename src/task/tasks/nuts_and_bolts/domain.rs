//! The paper's domain, written by hand, for planning without geometry.

use crate::task::propositional::DomainBuilder;

impl DomainBuilder {
    /// Returns a builder with the paper's domain (section II.E): put a nut and a bolt into the jig, then assemble them.
    pub fn of_the_paper() -> Self {
        Self::new()
            .action("PUT_NUT_IN_JIG", ["NUT_ON_TABLE"], ["NUT_IN_JIG"])
            .action("PUT_BOLT_IN_JIG", ["BOLT_ON_TABLE"], ["BOLT_IN_JIG"])
            .action("ASSEMBLE", ["NUT_IN_JIG", "BOLT_IN_JIG"], ["BOLT_ASSEMBLED"])
    }
}
