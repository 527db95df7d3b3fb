"""Read the findings that claims and captions share from the tables of paper 3's experiments."""

import numpy as np
import pandas as pd


def limit(stability: pd.DataFrame) -> float:
    """Return the step [sqrt(m/k)] from which a run of symplectic Euler grows."""
    return float(stability.loc[stability["scheme"] == "symplectic_euler", "blow_up_measured"].iloc[0])


def held(body_springs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the end of the hold."""
    times = body_springs["time_s"]
    return body_springs[times == times[body_springs["phase"] == "hold"].max()]


def moved(body_springs: pd.DataFrame) -> pd.Series:
    """Return the share of nodes that have moved at the end of the hold, by stiffness [N/m]; 0 is without springs."""
    rows = held(body_springs[body_springs["case"].isin(["none", "body_springs"])])
    sums = rows.groupby("body_springs_n_m")[["moved", "nodes"]].sum()
    return sums["moved"] / sums["nodes"]


def tips(clusters: pd.DataFrame) -> pd.Series:
    """Return the largest displacement [m] of the column, by number of clusters."""
    bent = clusters[["x_m", "y_m", "z_m"]].to_numpy() - clusters[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()
    return pd.Series(np.linalg.norm(bent, axis=1)).groupby(clusters["clusters"].to_numpy()).max()
