"""Two Arduino boards on serial lines: their protocol, clocks, ports and firmware."""
