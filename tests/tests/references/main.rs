//! Errors against reference files, which another renderer computed.

mod dictionary_accuracy;
mod radiosity_vs_oracle;
