//! ResourceAllocation (ICD 5.1.3).
