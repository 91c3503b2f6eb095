#!/usr/bin/env octave-cli
% A textbook navigator in GNU Octave for the lines of text of sinssim: north-pointing, one sample a step.
1;

function c = product(a, b)  % of quaternions
  c = [a(1) * b(1) - a(2:4)' * b(2:4); a(1) * b(2:4) + b(1) * a(2:4) + times_(a(2:4), b(2:4))];
end
function c = times_(a, b)  % of vectors
  c = [a(2) * b(3) - a(3) * b(2); a(3) * b(1) - a(1) * b(3); a(1) * b(2) - a(2) * b(1)];
end
function q = turn(r)  % the quaternion of a rotation vector
  angle = norm(r);
  if angle < 1e-8, s = 0.5; else s = sin(0.5 * angle) / angle; end
  q = [cos(0.5 * angle); s * r];
end
function x = step(x, sample, e, ge, k)  % the state after one sample
  lat = x(1); h = x(3); v = x(4:6); q = x(7:10); dt = sample(2); gyro = sample(3:5); accel = sample(6:8);
  a = e(1); f = e(2); e2 = f * (2 - f); m = e(4)^2 * a^3 * (1 - f) / e(3); root = sqrt(1 - e2 * sin(lat)^2);
  rn = a / root + h; rm = a * (1 - e2) / root^3 + h;
  g = ge * (1 + k * sin(lat)^2) / root * (1 - 2 * h / a * (1 + f + m - 2 * f * sin(lat)^2) + 3 * (h / a)^2);
  earth = e(4) * [cos(lat); 0; -sin(lat)];
  rate = earth + [v(2) / rn; -v(1) / rm; -v(2) * tan(lat) / rn];
  accel = accel + 0.5 * times_(gyro, accel);  % the body turns within the sample
  force = accel + 2 * times_(q(2:4), times_(q(2:4), accel) + q(1) * accel);
  force = force - 0.5 * dt * times_(rate, force);  % and so do the axes
  now = v + force + dt * ([0; 0; g] - times_(rate + earth, v));
  mean_v = 0.5 * (v + now);
  x(1:3) = x(1:3) + dt * [mean_v(1) / rm; mean_v(2) / (rn * cos(lat)); -mean_v(3)];
  x(4:6) = now;
  x(7:10) = product(turn(-dt * rate), product(q, turn(gyro)));
end

printf("sinssim 1\n");
numbers = struct();
while ischar(line = fgetl(stdin))
  [word, rest] = strtok(line);
  switch word
    case "imu"
      sample = sscanf(rest, "%g");
      x = step(x, sample, numbers.ellipsoid, numbers.gravity_equator, numbers.gravity_k);
      printf("solution %.17g%s\n", sample(1), sprintf(" %.17g", x));
      fflush(stdout);
    case "end"
      break;
    case {"state", "ellipsoid", "gravity_equator", "gravity_k"}
      numbers.(word) = sscanf(rest, "%g");
    case "begin"
      x = numbers.state;
  end
end
