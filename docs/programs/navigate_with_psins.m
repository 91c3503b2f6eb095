words = argv();                                            % directory of PSINS, directory of the export
addpath(genpath(words{1}));
global glv
glvf;                                                      % constants and units of PSINS
imu = imufile(fullfile(words{2}, 'imu.imu'));
fixes = avpfile(fullfile(words{2}, 'gnss.avp'));
start = dir(fullfile(words{2}, '*.avp'));                  % gnss.avp and the start
start = start(~strcmp({start.name}, 'gnss.avp'));
avp0 = avpfile(fullfile(words{2}, start.name))(1, 1:9)';

function write(path, avp, sigma)
  deg = 180/pi;
  head = 'time_s,roll_deg,pitch_deg,heading_deg,velocity_n_mps,velocity_e_mps,velocity_d_mps';
  head = [head ',latitude_deg,longitude_deg,height_m'];
  rows = [avp(:, end), avp(:, [2 1])*deg, mod(-avp(:, 3)*deg, 360), avp(:, [5 4]), -avp(:, 6)];
  rows = [rows, avp(:, 7:8)*deg, avp(:, 9)];
  if nargin > 2
    head = [head ',sigma_vn_mps,sigma_ve_mps,sigma_vd_mps,sigma_n_m,sigma_e_m,sigma_d_m'];
    rows = [rows, sigma];
  end
  file = fopen(path, 'w');
  fprintf(file, '%s\n', head);
  fprintf(file, [repmat('%.17g,', 1, columns(rows) - 1) '%.17g\n'], rows');
  fclose(file);
end

write('psins_inertial.csv', inspure(imu, avp0, 'f', 0));   % f: free vertical channel
if columns(fixes) < 7, exit, end                           % fixes without velocity

lever = [0; 0.5; 1.2];                                     % right, front, up
ins = insinit(avp0, mean(diff(imu(:, end))));
ins = inslever(ins, lever);
ins.vn = ins.vnL;                                          % sinsgps starts at the antenna
ins.pos = ins.posL;
metres = [ins.eth.RMh; ins.eth.clRNh; 1];
errors = [[10; 10; 60]*glv.min; 0.05*[1; 1; 1]; 1./metres];
noise = imuerrset(0.5, 0.00735499/glv.ug, 0.15, 0.001/glv.ug);   % deg/h, ug, deg/sqrt(h), ug/sqrt(Hz)
fix = [0.05*[1; 1; 1]; [1.5; 1.5; 3]./metres];
[avp, states] = sinsgps(imu, fixes, ins, errors, noise, [lever; 0; 0], [0; 0], fix, 0, 0, 'avped', 0);
avp(:, 4:9) -= states(:, 4:9);                             % the estimate that is not fed back yet
sigma = sqrt(states(:, 19 + [5 4 6 7 8 9])) .* [1 1 1 metres'];
whole = 50:50:rows(avp);                                   % once a second
write('psins_filter.csv', avp(whole, [1:9 end]), sigma(whole, :));
