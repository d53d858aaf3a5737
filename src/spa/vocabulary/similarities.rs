//! The similarities of a recorded output with expressions over a vocabulary.

use super::Vocabulary;
use crate::record::TimeSeries;
use crate::sim::{Pointer, Samples, VocabTag};
use crate::spa::algebra::dot;
use crate::spa::error::VocabError;

impl<V: VocabTag> Vocabulary<V> {
    /// Returns the similarity (dot product) of every sample with every expression, such as `NUT` or `JIG * NUT`. Costs
    /// O(samples x expressions x D).
    ///
    /// ```
    /// # use symbolt::prelude::*;
    /// symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
    ///
    /// let parts = Parts::vocabulary(64, Seed::new(1))?;
    /// let mut graph = GraphBuilder::new();
    /// let seen = graph.add("seen", State::new(&parts));
    /// graph.route(Parts::NUT >> &seen);
    /// let probe = graph.probe(&seen.output, ProbeSpec::default());
    /// let mut sim = graph.start(&PopulationPlan::direct(), Seed::new(1))?;
    /// sim.run_for(SimDuration::from_millis(100))?;
    ///
    /// let seen = parts.similarities(sim.samples(&probe), ["NUT", "BOLT"])?;
    /// println!("{seen}");
    /// assert!(seen.last("NUT").is_some_and(|similarity| similarity > 0.99));
    /// assert!(seen.to_svg("What is seen").starts_with("<svg"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As for [`Vocabulary::parse`]; [`VocabError::BadVector`] if the samples have another number of dimensions.
    pub fn similarities<'e>(
        &self,
        samples: Samples<'_, Pointer<V>>,
        expressions: impl IntoIterator<Item = &'e str>,
    ) -> Result<TimeSeries, VocabError> {
        let columns: Vec<String> = expressions.into_iter().map(String::from).collect();
        let pointers = columns.iter().map(|text| self.parse(text));
        let pointers = pointers.collect::<Result<Vec<_>, _>>()?;
        if samples.width() != self.dim() && !samples.is_empty() {
            let (found, dim) = (samples.width(), self.dim());
            let reason = format!("the samples have {found} components; expected {dim}");
            return Err(VocabError::BadVector { name: V::NAME.into(), reason });
        }
        let mut series = TimeSeries::new(columns, ("similarity", [-0.2, 1.05]));
        for (time, sample) in samples.iter() {
            series.push(time, pointers.iter().map(|pointer| dot(&sample, pointer)));
        }
        Ok(series)
    }
}
