// Photometric servoing with ViSP's public classes, as the peer of photometric loops in RobSim.
//
// Program: ViSP 3.5 (Debian: apt-get install --no-install-recommends libvisp-dev visp-images-data
//          g++ pkg-config).
// Build:   g++ -std=c++17 -O3 $(pkg-config --cflags visp) benchmarks/peer_photometric.cpp
//              -lvisp_robot -lvisp_visual_features -lvisp_io -lvisp_core -o peer_photometric
// Run:     ./peer_photometric Klimt.pgm [STEPS] [tests/oracles/photometric_visp.json]
// Writes:  a line for each start: iterations, sum of squares, and CPU time of a step, as H * L.t() *
//          e is written, and with L.t() * e first. A file gets the iterations and final errors as
//          JSON, always the same numbers.
//
// A poster of 0.6 x 0.43 m is seen by a camera with f = 870 px and 320 x 240 pixels; the goal is
// 1 m in front of its centre. The law is v = -30 (H + mu diag H)^-1 L' e with L at the goal, mu =
// 0.01, after 90 iterations 1e-4, and a period of 40 ms (Collewet and Marchand 2011). A run ends
// when the sum of the squared differences inside the border of 10 pixels is at most 10,000. The
// picture is Klimt.pgm of visp-images-data; Klimt.ppm has other grey values and other iterations.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <visp3/core/vpConfig.h>
#include <visp3/core/vpImage.h>
#include <visp3/io/vpImageIo.h>
#include <visp3/robot/vpImageSimulator.h>
#include <visp3/robot/vpSimulatorCamera.h>
#include <visp3/visual_features/vpFeatureLuminance.h>

#define AS_TEXT(x) #x
#define TEXT_OF(macro) AS_TEXT(macro)

const double WIDTH = 0.6, HEIGHT = 0.43, GAIN = 30, PERIOD = 0.04, LEAST = 10000;
const double DAMPING_FAR = 0.01, DAMPING_NEAR = 1e-4;
const int COLUMNS = 320, ROWS = 240, NEAR = 90;

struct Start {
  const char *name;
  double pose[6]; // x, y, z in metres and the rotation vector in degrees, of the poster
};

struct End {
  int iterations;
  double squares, metres, degrees, milliseconds;
};

const Start STARTS[] = {
    {"tilted", {0, 0, 1.2, 15, -5, 20}},     {"near", {0.02, 0.02, 1.1, 5, 5, 10}},
    {"5 cm aside", {0.05, 0, 1, 0, 0, 0}},   {"10 cm aside", {0.1, 0, 1, 0, 0, 0}},
    {"40 degrees of roll", {0, 0, 1, 0, 0, 40}},
};

double cpu_seconds()
{
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

vpHomogeneousMatrix pose_of(const double *p)
{
  vpHomogeneousMatrix T;
  T.buildFrom(p[0], p[1], p[2], vpMath::rad(p[3]), vpMath::rad(p[4]), vpMath::rad(p[5]));
  return T;
}

class Loop
{
public:
  explicit Loop(const char *file) : camera(870, 870, 160, 120), picture(ROWS, COLUMNS, 0)
  {
    vpImage<unsigned char> texture;
    vpImageIo::read(texture, file);
    std::vector<vpColVector> corners(4, vpColVector(3));
    const double x[] = {-1, 1, 1, -1}, y[] = {-1, -1, 1, 1};
    for (int i = 0; i < 4; i++) {
      corners[i][0] = x[i] * WIDTH / 2;
      corners[i][1] = y[i] * HEIGHT / 2;
      corners[i][2] = 0;
    }
    poster.setInterpolationType(vpImageSimulator::BILINEAR_INTERPOLATION);
    poster.init(texture, corners.data());
    goal_pose[2][3] = 1;
    prepare(goal);
    draw(goal_pose);
    goal.buildFrom(picture);
    prepare(present);
    goal.interaction(L);
    H = L.AtA();
    diagonal.resize(6, 6);
    for (int i = 0; i < 6; i++)
      diagonal[i][i] = H[i][i];
  }

  // left_first: (H L') e, in the order in which C++ multiplies H * L.t() * e; else H (L' e)
  End run(const Start &start, int most, bool left_first)
  {
    picture = 0;
    vpSimulatorCamera robot;
    robot.setSamplingTime(PERIOD);
    robot.setMaxTranslationVelocity(1e6);
    robot.setMaxRotationVelocity(1e6);
    vpHomogeneousMatrix T = pose_of(start.pose);
    robot.setPosition(T.inverse());
    robot.setRobotState(vpRobot::STATE_VELOCITY_CONTROL);
    vpColVector e;
    double squares = INFINITY, began = cpu_seconds();
    int count = 0;
    while (count < most && squares > LEAST) {
      count++;
      draw(T);
      present.buildFrom(picture);
      present.error(goal, e);
      squares = e.sumSquare();
      double mu = count > NEAR ? DAMPING_NEAR : DAMPING_FAR;
      vpMatrix inverse = (mu * diagonal + H).inverseByLU();
      vpColVector v = left_first ? inverse * L.t() * e : inverse * (L.t() * e);
      v *= -GAIN;
      robot.setVelocity(vpRobot::CAMERA_FRAME, v);
      T = robot.getPosition().inverse();
    }
    vpHomogeneousMatrix off = goal_pose * T.inverse();
    vpTranslationVector p = off.getTranslationVector();
    double angle = off.getThetaUVector().getTheta();
    return {count, squares, p.frobeniusNorm(), vpMath::deg(angle), (cpu_seconds() - began) / count * 1e3};
  }

private:
  void prepare(vpFeatureLuminance &feature)
  {
    feature.init(ROWS, COLUMNS, 1.0);
    feature.setCameraParameters(camera);
  }

  void draw(const vpHomogeneousMatrix &T)
  {
    poster.setCameraPosition(T);
    poster.getImage(picture, camera);
  }

  vpCameraParameters camera;
  vpImage<unsigned char> picture;
  vpImageSimulator poster;
  vpHomogeneousMatrix goal_pose;
  vpFeatureLuminance goal, present;
  vpMatrix L, H, diagonal;
};

int main(int count, char **arguments)
{
  if (count < 2 || count > 4) {
    std::fprintf(stderr, "usage: peer_photometric Klimt.pgm [STEPS] [FILE.json]\n");
    return 2;
  }
  int most = count > 2 ? std::atoi(arguments[2]) : 1000;
  Loop loop(arguments[1]);
  std::string rows;
  for (const Start &start : STARTS) {
    End end = loop.run(start, most, true);
    double quicker = loop.run(start, most, false).milliseconds;
    std::printf("%-20s %5d iterations  squares %14.1f  off %9.4f mm %9.5f deg  %7.3f ms a step, %7.3f with L'e first\n",
                start.name, end.iterations, end.squares, 1e3 * end.metres, end.degrees, end.milliseconds, quicker);
    char row[400];
    const double *p = start.pose;
    std::snprintf(row, sizeof row,
                  "%s\n  {\"name\": \"%s\", \"pose\": [%g, %g, %g, %g, %g, %g], \"converged\": %s, "
                  "\"iterations\": %d, \"squares\": %.6g, \"metres\": %.6g, \"degrees\": %.6g}",
                  rows.empty() ? "" : ",", start.name, p[0], p[1], p[2], p[3], p[4], p[5],
                  end.squares <= LEAST ? "true" : "false", end.iterations, end.squares, end.metres, end.degrees);
    rows += row;
  }
  if (count == 4) {
    FILE *file = std::fopen(arguments[3], "w");
    std::fprintf(file,
                 "{\n \"made_by\": \"ViSP %s, benchmarks/peer_photometric.cpp\",\n"
                 " \"picture\": \"Klimt.pgm of the Debian package visp-images-data\",\n"
                 " \"meaning\": \"pose: of the poster in camera axes, metres and the rotation vector in "
                 "degrees; iterations: of the loop that ends at a sum of squares of at most 10000; "
                 "metres, degrees: of the last pose from the goal\",\n \"most\": %d,\n \"rows\": [%s\n ]\n}\n",
                 TEXT_OF(VISP_VERSION), most, rows.c_str());
    std::fclose(file);
  }
  return 0;
}
