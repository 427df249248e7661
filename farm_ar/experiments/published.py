"""The numbers that the paper reports (Yu et al., doi:10.1007/s10055-025-01305-y), for comparison."""

TABLE_1 = {
    "L1": {"sites": 2, "types": 1, "objects": 16, "area_m2": 25},
    "L2": {"sites": 4, "types": 1, "objects": 8, "area_m2": 64},
    "M1": {"sites": 5, "types": 3, "objects": 35, "area_m2": 64},
    "M2": {"sites": 6, "types": 2, "objects": 30, "area_m2": 25},
    "H1": {"sites": 10, "types": 5, "objects": 52, "area_m2": 49},
    "H2": {"sites": 14, "types": 11, "objects": 48, "area_m2": 225},
}
"""The six synthetic scenes."""

TABLE_4 = {
    "pantry": {"sites": 2, "objects": 10, "area_m2": 18},
    "cafeteria": {"sites": 5, "objects": 16, "area_m2": 49},
    "classroom": {"sites": 7, "objects": 29, "area_m2": 130},
}
"""The three real-world scenes; the objects are chairs."""

TABLE_2 = {
    "all costs": (0.91, 0.19),
    "without translation": (0.17, 0.27),
    "without rotation": (0.76, 0.27),
    "without dimension": (0.85, 0.24),
}
"""Mean and SD of the accuracy along the path of H1 once, T(0, 0.3), R(0, 30)."""

TABLE_3 = (0.214, 0.150, 0.129, 0.110, 0.109, 0.080, 0.076, 0.067, 0.065)
"""Probabilities of the sites that the camera of Fig. 6 is not in, largest first; the names are below."""

TABLE_3_SITES = ("S6", "S3", "S10", "S9", "S2", "S4", "S7", "S1", "S8")

OFFICES = ("L2", "M1", "H2")
OFFICE_MEAN_AT_R50 = 0.7739
"""Mean accuracy of the offices over the low translation noises at a rotation SD of 50 degrees (Fig. 5)."""

OFFICE_MEAN_AT_T05 = 0.7723
"""Mean accuracy of the offices over all rotation noises at a translation SD of 0.5 m (Fig. 5)."""

FIG_9 = {0.50: 0.91, 0.75: 1.00, 1.00: 1.00}
"""Accuracy at the thresholds that the paper names."""

FIG_9_TIME = {0.50: 0.5, 0.75: 0.8}
"""Time as a share of that without pruning, about."""

FIG_7 = {
    "all costs": 1.00,
    "without translation": 0.14,
    "without rotation": 0.43,
    "without dimension": 0.71,
}
"""Accuracies of the worked example of Fig. 7 (section 4.1.2: without a term it loses 86, 57 and 29%)."""

H1_CAMERA = (2.408, 3.759, -168.5)
"""The camera of Figs. 6 and 8: x, z in metres, heading in degrees.

Solved from Table 3; the paper shows it as a dot only.
"""

TABLE_5 = {"pantry": (80.82, 22.26), "cafeteria": (88.51, 18.05), "classroom": (80.10, 14.16)}
"""Mean and SD of the accuracy of a frame in the real rooms, %."""

TABLE_5_TIME = {"pantry": 2.82, "cafeteria": 4.43, "classroom": 5.66}
"""Mean time to solve a frame with lp_solve on a HoloLens 2, milliseconds."""
