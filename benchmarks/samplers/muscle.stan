// Joint posterior of staircases: the equations of benchmarks/ode.py, the noise model of
// muscle_bayes.inference.model.noise and the priors, written out. Units: rad, N m, N, s, degrees C, counts.
functions {
  // Tension of a spring that needs a minimum force to open.
  real tensile(real strain, real stiffness, real minimum, real eps) {
    return minimum / eps * fmin(fmax(strain, 0), eps) + stiffness * fmax(strain - eps, 0);
  }

  // Strain at which it pulls with `force`.
  real tensile_strain(real force, real stiffness, real minimum, real eps) {
    return eps * fmin(fmax(force / minimum, 0), 1) + fmax(force - minimum, 0) / stiffness;
  }

  // Length between the pins and its derivative in q.
  vector pins(real q, data vector rig) {
    real sine = sin(q);
    real cosine = cos(q);
    real length = hypot(rig[2] - rig[1] * cosine, rig[3] + rig[1] * sine);
    return [length, rig[1] * (rig[2] * sine + rig[3] * cosine) / length]';
  }

  real effective(real temperature, data vector rig) {
    return rig[6] + rig[5] * (temperature - rig[6]);
  }

  // Strain of MODULUS; p: D, A, B, C, F_hyst_min, K_hyst, F_modulus_min, K_modulus, H, T_hyst_offset.
  real modulus_strain(real length, real hyst, real heat, vector p, data vector rig) {
    return length / rig[4] - 1 - ((p[2] * heat + p[3]) * heat + p[4]) - hyst;
  }

  // What turns the rotor, but for dry friction, and by how much that falls with q.
  vector torque(real q, real hyst, real heat, vector p, data vector rig, data real eps) {
    vector[2] pin = pins(q, rig);
    real strain = modulus_strain(pin[1], hyst, heat, p, rig);
    real pull = tensile(strain, rig[4] * p[8], p[7], eps);
    real slope = strain > eps ? rig[4] * p[8] : strain > 0 ? p[7] / eps : 0;
    real swing = rig[1] * (rig[2] * cos(q) - rig[3] * sin(q));
    real turning = (swing - square(pin[2])) / pin[1];
    return [rig[7] - pull * pin[2], slope * square(pin[2]) / rig[4] + pull * turning]';
  }

  // Where a rotor put down at `begin` rests: there, or where its torque has fallen to dry friction, or at
  // a stop. Newton's method in a bracket; its last step carries the derivative.
  real rest(real begin, real hyst, real heat, vector p, data vector rig, data real eps) {
    real force = torque(begin, hyst, heat, p, rig, eps)[1];
    if (abs(force) <= p[1]) {
      return begin;
    }
    int side = force > 0 ? 1 : -1;
    real stop = side > 0 ? rig[9] : rig[8];
    real near = begin;
    real width = 1e-3;
    real beyond = begin + side * width;
    while (side * torque(beyond, hyst, heat, p, rig, eps)[1] > p[1]) {
      if (side * (stop - beyond) <= 0) {
        return stop;
      }
      near = beyond;
      width *= 2;
      beyond = begin + side * fmin(width, side * (stop - begin));
    }
    real q = near;
    for (look in 1 : 60) {
      vector[2] now = torque(q, hyst, heat, p, rig, eps);
      real over = side * now[1] - p[1];
      if (over > 0) {
        near = q;
      } else {
        beyond = q;
      }
      // Where the muscle is slack the slope is zero; a quotient by it would spoil the gradient, used or not.
      real next = 0.5 * (near + beyond);
      if (now[2] > 0) {
        real newton = q + side * over / now[2];
        if ((newton - near) * (newton - beyond) <= 0) {
          next = newton;
        }
      }
      if (abs(next - q) < 1e-12) {
        return next;
      }
      q = next;
    }
    return q;
  }

  // d(q, sigma_hyst)/dt. `relative`: p in typical units, without which sensitivities to parameters of very
  // different size would be asked for the same absolute accuracy. The heater's temperature is linear
  // between the course's instants.
  vector rates(real t, vector state, vector relative, data vector typical, data vector rig,
               data real eps, data real damping, data real damper_floor, data array[] real time,
               data array[] real heater) {
    int low = 1;
    int high = size(time);
    while (high - low > 1) {
      int middle = (low + high) %/% 2;
      if (time[middle] <= t) {
        low = middle;
      } else {
        high = middle;
      }
    }
    real share = (t - time[low]) / (time[high] - time[low]);
    vector[10] p = relative .* typical;
    real heat = effective(heater[low] + share * (heater[high] - heater[low]), rig);
    vector[2] pin = pins(state[1], rig);
    real tension = tensile(modulus_strain(pin[1], state[2], heat, p, rig), rig[4] * p[8], p[7], eps);
    real held = tensile(state[2], rig[4] * p[6], p[5], eps);
    real damper = fmax(p[9] * (heat + p[10]), damper_floor);
    real force = rig[7] - tension * pin[2];
    real driven = fmax(force - p[1], 0) + fmin(force + p[1], 0);
    return [driven / damping, (tension - held) / (damper * rig[4])]';
  }

  // Log density of a run's mean readings, less the model's: white noise, and an Ornstein-Uhlenbeck
  // discrepancy whose clock runs while the model moves.
  real reading_lpdf(vector residual, vector predicted, data vector gap, data vector weight,
                    data vector coarse, real noise, real discrepancy, real correlation_time,
                    data real quantum, data real at_rest) {
    real density = 0;
    real state = 0;
    real stationary = square(discrepancy);
    real spread = stationary;
    for (i in 1 : size(residual)) {
      if (gap[i] > 0) { // not the first, nor what a shorter run is held on for
        real moved = square(predicted[i] - predicted[i - 1]);
        real still = stationary * square(gap[i] / correlation_time);
        real running = gap[i] * (at_rest + (1 - at_rest) * moved / (moved + still));
        real fade = exp(-running / correlation_time);
        state *= fade;
        spread = square(fade) * spread + (1 - square(fade)) * stationary;
      }
      if (weight[i] > 0) {
        real total = spread + square(noise) / weight[i] + square(quantum) * coarse[i];
        real error = residual[i] - state;
        density += normal_lpdf(error | 0, sqrt(total));
        state += spread / total * error;
        spread *= 1 - spread / total;
      }
    }
    return density;
  }
}
data {
  int<lower=1> lanes;
  array[lanes] int<lower=1> intervals;
  array[sum(intervals) * 2 + lanes] real time; // of each lane, one after the other: 2 intervals + 1
  array[sum(intervals) * 2 + lanes] real heater;
  vector[sum(intervals)] reading;
  vector[sum(intervals)] gap; // to the reading before
  vector[sum(intervals)] weight;
  vector[sum(intervals)] coarse;
  array[lanes] vector[9] rig; // radius, anchor x and y, base length, heated share, room, load, stops
  vector[lanes] scale; // rad per count
  vector[lanes] quantum;
  real eps;
  real damper_floor;
  real at_rest;
  real cold;
  real hot;
  real tension; // to which taut_strain refers
  real damping; // c of the overdamped rotor
  real tolerance;
  vector[10] typical;
  int<lower=1> size_z;
  vector[size_z] mode;
  matrix[size_z, size_z] factor;
  vector[size_z] location; // of the priors, normal in the unconstrained vector but for three
  vector[size_z] spread;
  vector<lower=0>[2] softening_prior;
}
parameters {
  vector[size_z] z;
}
model {
  vector[size_z] u = mode + factor * z;
  real D = exp(u[2]);
  real taut_strain = u[3];
  real contraction = exp(u[4]);
  real bend = u[5];
  real modulus = exp(u[6]);
  real F_modulus_min = exp(u[7]);
  real stiffness_hyst = exp(u[8]);
  real F_hyst_min = exp(u[9]);
  real time_constant = exp(u[10]);
  real softening = inv_logit(u[11]);
  real noise = exp(u[12]);
  real discrepancy = exp(u[13]);
  real correlation_time = exp(u[14]);
  vector[lanes] zero = segment(u, 15, lanes);
  vector[lanes] start = segment(u, 15 + lanes, lanes);
  vector[lanes] lag = segment(u, 15 + 2 * lanes, lanes);

  // Lognormal quantities are normal in u.
  target += normal_lpdf(u[1] | location[1], spread[1]);
  target += cauchy_lpdf(exp(u[2]) | 0, spread[2]) + u[2]; // half-Cauchy: twice this, a constant
  target += normal_lpdf(u[3] | location[3], spread[3]);
  target += normal_lpdf(contraction | 0, spread[4]) + u[4];
  target += normal_lpdf(u[5 : 10] | location[5 : 10], spread[5 : 10]);
  target += beta_lpdf(softening | softening_prior[1], softening_prior[2])
            + log(softening) + log1m(softening);
  target += normal_lpdf(u[12 : size_z] | location[12 : size_z], spread[12 : size_z]);

  real resting = tensile_strain(tension, stiffness_hyst, F_hyst_min, eps);
  vector[lanes] hyst;
  for (lane in 1 : lanes) {
    hyst[lane] = fmax(resting + lag[lane], 0.1 * eps);
  }

  // Table 2's parameters.
  real span = hot - cold;
  real a = -4 * bend * contraction / square(span);
  real b = -contraction / span - a * (hot + cold);
  real thermal = taut_strain - tensile_strain(tension, modulus, F_modulus_min, eps) - resting;
  real length = rig[1][4];
  real damper = time_constant * stiffness_hyst / length;
  real h = -damper * (1 - softening) / span;
  vector[10] p = [D, a, b, thermal - (a * cold + b) * cold, F_hyst_min, stiffness_hyst / length,
                  F_modulus_min, modulus / length, h, damper / h - cold]';

  int done = 0;
  for (lane in 1 : lanes) {
    int n = intervals[lane];
    int begun = 2 * done + lane;
    array[2 * n + 1] int instants = linspaced_int_array(2 * n + 1, begun, begun + 2 * n);
    real shown = scale[lane] * (start[lane] - zero[lane]);
    real heat = effective(heater[begun], rig[lane]);
    vector[2] begin = [rest(shown, hyst[lane], heat, p, rig[lane], eps), hyst[lane]]';
    array[2 * n] vector[2] states
      = ode_bdf_tol(rates, begin, time[begun], time[instants[2 : ]], tolerance, tolerance, 1000000,
                    p ./ typical, typical, rig[lane], eps, damping, damper_floor,
                    time[instants], heater[instants]);
    vector[n] predicted;
    for (i in 1 : n) {
      real before = i == 1 ? begin[1] : states[2 * i - 2][1];
      predicted[i] = 0.25 * (before + 2 * states[2 * i - 1][1] + states[2 * i][1]) / scale[lane];
    }
    target += reading_lpdf(segment(reading, done + 1, n) - zero[lane] - predicted | predicted,
                           segment(gap, done + 1, n), segment(weight, done + 1, n),
                           segment(coarse, done + 1, n), noise, discrepancy, correlation_time,
                           quantum[lane], at_rest);
    done += n;
  }
}
