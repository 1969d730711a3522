"""Published parameters (thesis, Tables 1 and 2), about which synthetic draws scatter."""

TABLE_1_LINEAR = {"J": 0.00131390, "D": 0.00415667}
TABLE_1_COULOMB = {"J": 0.00124103, "D": 0.00545940}
TABLE_2 = {
    "A": -1.17832e-5,
    "B": 1.40992e-5,
    "C": 0.00881695,
    "F_hyst_min": 1.75489,
    "K_hyst": 415.189,
    "F_modulus_min": 3.789,
    "K_modulus": 186.0,
    "H": -545.907,
    "T_hyst_offset": -243.380,
}
COIL_CONTACT = {
    "coil-contact.stiffness": 200.0,
    "coil-contact.onset": 0.12,
    "coil-contact.width": 0.0,
}
HEATER = {"heater.gain": 4.5, "heater.cooling": 1 / 48, "heater.lag": 0.0}
