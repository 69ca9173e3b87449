//! Reports on materials, every number from the run that writes it: the audit of laws and limits,
//! speed against error, the material sheet.

pub mod appearance;
pub mod audit;
pub mod audit_page;
pub mod axis;
pub mod chart;
pub mod deviation;
pub mod distance;
pub mod estimate;
pub mod heat;
pub mod laws;
pub mod machine;
pub mod measured;
pub mod measured_page;
pub mod measured_table;
mod methods;
pub mod number;
pub mod parameters;
pub mod pareto_front;
pub mod polar;
pub mod sheet;
pub mod sheet_page;
pub mod sheet_plots;
pub mod speed_error;
pub mod speed_error_page;
pub mod stopwatch;
pub mod surface;
pub mod view;
