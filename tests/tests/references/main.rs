//! Errors against files that another renderer computed.

mod dictionary_accuracy;
mod radiosity_vs_oracle;
