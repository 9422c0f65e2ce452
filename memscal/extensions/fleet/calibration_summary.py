"""One calibration of many as tables, a mapping and a row of a data frame."""

from memscal.errors import InputError
from memscal.extensions.fleet.many import FleetCalibration
from memscal.model.arrays import Values
from memscal.model.quantities import parameter_quantity
from memscal.model.records import TRANSFER
from memscal.summaries.calibration import estimate_rows
from memscal.summaries.declared import DataFrame, correlated_parameters, members, parameters_json
from memscal.summaries.table import Table, checks_json, checks_table, texts_of


def tables(result: FleetCalibration) -> list[Table]:
    """Return the estimates and the quality checks, or the error."""
    if result.parameters is None or result.resolved_wavenumber is None:
        return [Table(f"Scan {result.index}", ("", ""), [("error", str(result.error))])]
    rows = estimate_rows(result.parameters, result.resolved_wavenumber, result.messages)
    title = f"Scan {result.index} (± standard uncertainty, k = 1)"
    return [Table(title, ("", "", ""), rows), checks_table(result.checks)]


def mapping(result: FleetCalibration) -> Values:
    """Return the estimates and the quality checks, or the error."""
    values = {"index": result.index, "passed": result.passed}
    if result.parameters is None:
        return values | {"error": str(result.error)}
    estimates = parameters_json(result.parameters)
    checks = checks_json(result.checks)
    warnings = texts_of(result.messages)
    resolved = members(TRANSFER.quantities[-1:], result)
    return values | estimates | resolved | {"checks": checks, "warnings": warnings}


def frame(result: FleetCalibration) -> DataFrame:
    """Return one row, which ``pandas.concat`` joins with those of the other scans."""
    import pandas as pd

    row = {"passed": result.passed, "error": str(result.error or "")}
    parameters = result.parameters
    if parameters is not None:
        for name in parameters.names:
            unit = parameter_quantity(parameters, name).si_unit
            row[f"{name} ({unit})"] = parameters[name]
            row[f"u({name}) ({unit})"] = parameters.uncertainty(name)
        row["resolved_wavenumber (rad/m)"] = result.resolved_wavenumber
    return pd.DataFrame(row, index=pd.Index([result.index], name="scan"))


def correlated(result: FleetCalibration) -> Values:
    """Return the parameters as numbers of the package uncertainties, with their covariance."""
    if result.parameters is None:
        raise InputError(f"Scan {result.index} could not be calibrated.", why=str(result.error))
    return correlated_parameters(result.parameters)
