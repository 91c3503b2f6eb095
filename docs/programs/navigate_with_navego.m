pkg load control                                           % obsv; its function kalman must not hide that of NaveGo
words = argv();                                            % directory of NaveGo, directory of the export, start
addpath(genpath(words{1}));
read = @(name) dlmread(fullfile(words{2}, name), ',', 1, 0);
imu_rows = read('imu.csv');
fixes = read('gnss.csv');
start = read(words{3})(1, :);
rad = pi/180;
step = mean(diff(imu_rows(:, 1)));

imu.t = [start(1); imu_rows(:, 1)];                        % row i is the interval that ends at its time
imu.wb = [imu_rows(1, 2:4); imu_rows(:, 2:4)]/step;
imu.fb = [imu_rows(1, 5:7); imu_rows(:, 5:7)]/step;
imu.ini_align = start(12:14)*rad;
imu.ini_align_err = [10 10 60]/60*rad;
imu.arw = [1 1 1]*0.15/60*rad;
imu.vrw = [1 1 1]*0.001;
imu.gb_sta = [0 0 0];
imu.ab_sta = [0 0 0];
imu.gb_dyn = [0 0 0];
imu.ab_dyn = [0 0 0];
imu.gb_corr = [Inf Inf Inf];                               % constant biases
imu.ab_corr = [Inf Inf Inf];
imu.gb_psd = [0 0 0];
imu.ab_psd = [0 0 0];

with_velocity = columns(fixes) > 7;
if ~with_velocity, fixes(:, 8:13) = NaN; end
every = [start(1:4) nan(1, 3) start(5:7) nan(1, 3); fixes];   % NaveGo starts at the first row of the fixes
gnss.t = every(:, 1);
gnss.lat = every(:, 2)*rad;
gnss.lon = every(:, 3)*rad;
gnss.h = every(:, 4);
gnss.vel = every(:, 8:10);
gnss.stdm = [1.5 1.5 3];
gnss.stdv = [0.05 0.05 0.05];
[RM, RN] = radius(gnss.lat(1));
metres = [RM + gnss.h(1), (RN + gnss.h(1))*cos(gnss.lat(1)), 1];
gnss.std = gnss.stdm ./ metres;
gnss.larm = [0.5; 0; -1.2];                                % forward, right, down
gnss.zupt_th = 0;
gnss.zupt_win = 0.5;
gnss.eps = step/2;

function write(path, nav, which)
  deg = 180/pi;
  head = 'time_s,roll_deg,pitch_deg,heading_deg,velocity_n_mps,velocity_e_mps,velocity_d_mps';
  head = [head ',latitude_deg,longitude_deg,height_m'];
  rows = [nav.t, nav.roll*deg, nav.pitch*deg, mod(nav.yaw*deg, 360), nav.vel, nav.lat*deg, nav.lon*deg, nav.h];
  file = fopen(path, 'w');
  fprintf(file, '%s\n', head);
  fprintf(file, [repmat('%.17g,', 1, columns(rows) - 1) '%.17g\n'], rows(which, :)');
  fclose(file);
end

write('navego_inertial.csv', ins(imu, gnss, 'quaternion'), 1:length(imu.t));
if ~with_velocity, exit, end

imu.gb_dyn = [1 1 1]*0.5/3600*rad;                         % 1 sigma of the biases, and where NaveGo starts them
imu.ab_dyn = [1 1 1]*0.00735499;
nav = ins_gnss(imu, gnss, 'quaternion');
write('navego_filter.csv', nav, 101:100:length(imu.t));    % once a second
sigma = sqrt(nav.Pp(:, (3:8)*16 + 1)) .* [1 1 1 metres];   % at the fixes
dlmwrite('navego_sigma.csv', [gnss.t sigma](2:end, :), 'precision', 17);
