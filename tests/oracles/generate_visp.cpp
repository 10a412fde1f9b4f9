// Oracle: features, moments, gains, control laws and poses by ViSP, through its public classes.
//
// Program: ViSP 3.5 (Debian: apt-get install --no-install-recommends libvisp-dev g++ pkg-config).
// Build:   g++ -std=c++17 -O1 $(pkg-config --cflags visp) tests/oracles/generate_visp.cpp
//              -lvisp_vs -lvisp_vision -lvisp_visual_features -lvisp_core -o generate_visp
// Run:     ./generate_visp tests/oracles/visp.json
// Writes:  visp.json, always the same numbers, each with the shortest text that reads back exactly.
//
// Everything is in camera axes (x right, y down, z along the optical axis), metres and radians.
// What a group holds and the conventions of its numbers stand in its "meaning".

#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <visp3/core/vpCircle.h>
#include <visp3/core/vpConfig.h>
#include <visp3/core/vpLine.h>
#include <visp3/core/vpMomentCommon.h>
#include <visp3/core/vpMomentObject.h>
#include <visp3/core/vpPoint.h>
#include <visp3/core/vpSphere.h>
#include <visp3/vision/vpPose.h>
#include <visp3/visual_features/vpFeatureBuilder.h>
#include <visp3/visual_features/vpFeatureDepth.h>
#include <visp3/visual_features/vpFeatureMomentCommon.h>
#include <visp3/visual_features/vpFeaturePoint3D.h>
#include <visp3/visual_features/vpFeaturePointPolar.h>
#include <visp3/visual_features/vpFeatureThetaU.h>
#include <visp3/visual_features/vpFeatureTranslation.h>
#include <visp3/visual_features/vpFeatureVanishingPoint.h>
#include <visp3/vs/vpAdaptiveGain.h>
#include <visp3/vs/vpServo.h>

#define AS_TEXT(x) #x
#define TEXT_OF(macro) AS_TEXT(macro)

using Numbers = std::vector<double>;
using Marks = std::vector<Numbers>;

const int CASES = 12, MOMENT_CASES = 8;

// --- JSON ---------------------------------------------------------------------------------------

std::string json(double value)
{
  if (!std::isfinite(value))
    throw std::runtime_error("a number is not finite");
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

std::string json(int value) { return std::to_string(value); }

std::string json(const std::string &value) { return "\"" + value + "\""; }

template <class T> std::string json(const std::vector<T> &values)
{
  std::string text;
  for (const T &value : values)
    text += (text.empty() ? "" : ", ") + json(value);
  return "[" + text + "]";
}

std::string json(const vpColVector &v) { return json(v.toStdVector()); }

std::string json(const vpMatrix &M)
{
  std::vector<Numbers> rows;
  for (unsigned int i = 0; i < M.getRows(); i++)
    rows.push_back(Numbers(M[i], M[i] + M.getCols()));
  return json(rows);
}

std::string json(const vpHomogeneousMatrix &T)
{
  vpMatrix M(4, 4);
  for (unsigned int i = 0; i < 4; i++)
    for (unsigned int j = 0; j < 4; j++)
      M[i][j] = T[i][j];
  return json(M);
}

// One line of the file: the keys and values of a case.
struct Case
{
  std::string text;

  template <class T> Case &with(const std::string &key, const T &value)
  {
    text += (text.empty() ? "" : ", ") + json(key) + ": " + json(value);
    return *this;
  }
};

struct Document
{
  std::ostringstream text;

  Document(const std::string &about)
  {
    text << "{\n \"made_by\": \"ViSP " TEXT_OF(VISP_VERSION) "\",\n \"about\": " << json(about);
  }

  void group(const std::string &name, const std::string &meaning, const std::vector<Case> &cases)
  {
    text << ",\n " << json(name) << ": {\n  \"meaning\": " << json(meaning) << ",\n  \"cases\": [";
    for (size_t i = 0; i < cases.size(); i++)
      text << (i ? ",\n   {" : "\n   {") << cases[i].text << "}";
    text << "\n  ]\n }";
  }
};

// --- random inputs ------------------------------------------------------------------------------

std::mt19937_64 source(20240611);

// Uniform, with four decimals: short in the file, and exactly what the file says.
double uniform(double low, double high)
{
  double fraction = double(source() >> 11) / 9007199254740992.0;
  return std::round((low + (high - low) * fraction) * 1e4) / 1e4;
}

Numbers uniforms(const Numbers &low, const Numbers &high)
{
  Numbers result;
  for (size_t i = 0; i < low.size(); i++)
    result.push_back(uniform(low[i], high[i]));
  return result;
}

Numbers mark() { return uniforms({-0.5, -0.5, 0.8}, {0.5, 0.5, 2.5}); }

Numbers direction()
{
  Numbers d;
  double length;
  do {
    d = uniforms({-1, -1, -1}, {1, 1, 1});
    length = std::hypot(d[0], d[1], d[2]);
  } while (length > 1 || length < 0.1);
  return {d[0] / length, d[1] / length, d[2] / length};
}

vpHomogeneousMatrix random_pose(const Numbers &low, const Numbers &high, double angle)
{
  Numbers t = uniforms(low, high), u = direction();
  double theta = uniform(0.1 * angle, angle);
  return vpHomogeneousMatrix(t[0], t[1], t[2], theta * u[0], theta * u[1], theta * u[2]);
}

Numbers cross(const Numbers &a, const Numbers &b)
{
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Numbers along(const Numbers &from, const Numbers &way, double length)
{
  return {from[0] + length * way[0], from[1] + length * way[1], from[2] + length * way[2]};
}

// --- objects as a camera sees them --------------------------------------------------------------

vpPoint seen(const Numbers &X)
{
  vpPoint point(X[0], X[1], X[2]);
  point.track(vpHomogeneousMatrix());
  return point;
}

vpColVector plane_through(const Numbers &P, const Numbers &Q, const Numbers &R)
{
  Numbers n = cross(along(Q, P, -1), along(R, P, -1));
  double length = std::hypot(n[0], n[1], n[2]);
  vpColVector plane(4);
  for (int i = 0; i < 3; i++) {
    plane[i] = n[i] / length;
    plane[3] -= plane[i] * P[i];
  }
  return plane;
}

// The line through P and Q as the meeting of two planes, each through a further random point.
vpLine line_through(const Numbers &P, const Numbers &Q)
{
  vpLine line;
  line.setWorldCoordinates(plane_through(P, Q, mark()), plane_through(P, Q, mark()));
  line.track(vpHomogeneousMatrix());
  return line;
}

template <class Feature> Case feature(Case given, Feature &s)
{
  return given.with("s", s.get_s()).with("L", s.interaction());
}

// --- groups -------------------------------------------------------------------------------------

void points(Document &document)
{
  std::vector<Case> cartesian, polar, depth, spatial;
  for (int i = 0; i < CASES; i++) {
    Numbers X = mark();
    vpPoint point = seen(X);
    Case given = Case().with("marks", Marks{X});

    vpFeaturePoint p;
    vpFeatureBuilder::create(p, point);
    cartesian.push_back(feature(given, p));

    vpFeaturePointPolar q;
    vpFeatureBuilder::create(q, point);
    polar.push_back(feature(given, q));

    vpFeaturePoint3D x;
    vpFeatureBuilder::create(x, point);
    spatial.push_back(feature(given, x));

    double goal_depth = uniform(0.5, 3.0);
    vpFeatureDepth z;
    z.buildFrom(point.get_x(), point.get_y(), X[2], std::log(X[2] / goal_depth));
    depth.push_back(feature(Case(given).with("goal_depth", goal_depth), z));
  }
  document.group("point", "one mark; s = (x, y)", cartesian);
  document.group("polar", "one mark; s = (rho, theta), x = rho cos theta, y = rho sin theta, "
                          "theta in [-pi, pi]", polar);
  document.group("depth", "one mark; s = log(Z / goal_depth)", depth);
  document.group("point3d", "one mark; s = (X, Y, Z)", spatial);
}

void segments(Document &document)
{
  std::vector<Case> plain, normalised;
  for (int i = 0; i < CASES; i++) {
    Marks ends = {mark(), mark()};
    vpPoint P = seen(ends[0]), Q = seen(ends[1]);
    for (bool normalise : {false, true}) {
      vpFeatureSegment s(normalise);
      vpFeatureBuilder::create(s, P, Q);
      (normalise ? normalised : plain).push_back(feature(Case().with("marks", ends), s));
    }
  }
  document.group("segment", "two marks, the ends p1 and p2 in the image; s = (xc, yc, l, alpha), "
                            "the middle, the length and the angle of p1 - p2 by atan2", plain);
  document.group("segment_normalised", "two marks; s = (xc / l, yc / l, 1 / l, alpha) of the "
                                       "group segment", normalised);
}

void lines(Document &document)
{
  std::vector<Case> cases;
  for (int i = 0; i < CASES; i++) {
    Marks two = {mark(), mark()};
    vpFeatureLine s;
    vpFeatureBuilder::create(s, line_through(two[0], two[1]));
    cases.push_back(feature(Case().with("marks", two), s));
  }
  document.group("line", "the line through two marks; s = (rho, theta) with x cos theta + "
                         "y sin theta = rho, rho of either sign, theta in [-pi, pi]; L of a plane "
                         "AX + BY + CZ + D = 0 that holds the line, and does not depend on which",
                 cases);
}

void vanishing_points(Document &document)
{
  std::vector<Case> cartesian, angles;
  unsigned int xy = vpFeatureVanishingPoint::selectX() | vpFeatureVanishingPoint::selectY();
  unsigned int others = vpFeatureVanishingPoint::selectOneOverRho() |
                        vpFeatureVanishingPoint::selectAlpha();
  for (int i = 0; i < CASES; i++) {
    Numbers P = mark(), Q = mark(), way = direction();
    Marks four = {P, along(P, way, 0.3), Q, along(Q, way, 0.4)};
    vpLine first = line_through(four[0], four[1]), second = line_through(four[2], four[3]);
    Case given = Case().with("marks", four);

    vpFeatureVanishingPoint s;
    vpFeatureBuilder::create(s, first, second, xy);
    Numbers values = {s.get_x(), s.get_y()};
    cartesian.push_back(Case(given).with("s", values).with("L", s.interaction(xy)));

    vpFeatureVanishingPoint t;
    vpFeatureBuilder::create(t, first, second, others);
    values = {t.getOneOverRho(), t.getAlpha()};
    angles.push_back(Case(given).with("s", values).with("L", t.interaction(others)));
  }
  document.group("vanishing_point", "two parallel lines in space, through marks 0, 1 and through "
                                    "marks 2, 3; s = (x, y) where their images meet", cartesian);
  document.group("vanishing_point_polar", "as vanishing_point; s = (1 / rho, alpha) as ViSP makes "
                                          "them from the polar coordinates of the lines", angles);
}

void ellipses(Document &document)
{
  std::vector<Case> circles, spheres;
  for (int i = 0; i < CASES; i++) {
    Numbers centre = mark(), normal = direction();
    double radius = uniform(0.05, 0.3);
    vpCircle circle(normal[0], normal[1], normal[2], centre[0], centre[1], centre[2], radius);
    circle.track(vpHomogeneousMatrix());
    vpFeatureEllipse s;
    vpFeatureBuilder::create(s, circle);
    Case given = Case().with("centre", centre).with("radius", radius);
    circles.push_back(feature(Case(given).with("normal", normal), s));

    vpSphere sphere(centre[0], centre[1], centre[2], radius);
    sphere.track(vpHomogeneousMatrix());
    vpFeatureEllipse t;
    vpFeatureBuilder::create(t, sphere);
    spheres.push_back(feature(given, t));
  }
  std::string s = "; s = (xg, yg, n20, n11, n02): centre of the ellipse in the image and n_ij = "
                  "mu_ij / area";
  document.group("circle", "a circle in space" + s, circles);
  document.group("sphere", "a sphere" + s + "; L of the plane that holds its limb", spheres);
}

void poses(Document &document)
{
  std::vector<Case> current, goal, travelled, back, object;
  for (int i = 0; i < CASES; i++) {
    vpHomogeneousMatrix T_goal_c = random_pose({-1, -1, -1}, {1, 1, 1}, 3.0);
    vpHomogeneousMatrix T_c_goal = T_goal_c.inverse();
    vpHomogeneousMatrix T_c_o = random_pose({-0.5, -0.5, 0.8}, {0.5, 0.5, 2.5}, 3.0);
    Case given = Case().with("T_goal_c", T_goal_c);

    vpFeatureThetaU u(T_goal_c, vpFeatureThetaU::cdRc), v(T_c_goal, vpFeatureThetaU::cRcd);
    current.push_back(feature(given, u));
    goal.push_back(feature(given, v));

    vpFeatureTranslation t(T_goal_c, vpFeatureTranslation::cdMc);
    travelled.push_back(feature(given, t));
    vpFeatureTranslation w(T_c_goal, vpFeatureTranslation::cMcd);
    back.push_back(feature(given, w));
    vpFeatureTranslation o(T_c_o, vpFeatureTranslation::cMo);
    object.push_back(feature(Case().with("T_c_o", T_c_o), o));
  }
  std::string pose = "T_goal_c: pose of the camera in the goal camera; s = ";
  document.group("theta_u_cdRc", pose + "rotation vector of R_goal_c", current);
  document.group("theta_u_cRcd", pose + "rotation vector of R_c_goal", goal);
  document.group("translation_cdMc", pose + "translation of T_goal_c", travelled);
  document.group("translation_cMcd", pose + "translation of T_c_goal", back);
  document.group("translation_cMo", "T_c_o: pose of the object in the camera; s = its translation",
                 object);
}

// Corners of a region, star-shaped about a random centre, in the order in which ViSP wants them.
Marks corners()
{
  int number = 4 + int(source() % 4);
  Numbers centre = uniforms({-0.2, -0.2}, {0.2, 0.2});
  Marks image;
  for (int i = 0; i < number; i++) {
    double angle = 2 * M_PI * (i + uniform(-0.3, 0.3)) / number, radius = uniform(0.1, 0.35);
    image.push_back({centre[0] + radius * std::cos(angle), centre[1] + radius * std::sin(angle)});
  }
  return image;
}

Marks onto_plane(const Marks &image, const Numbers &plane)
{
  Marks marks;
  for (const Numbers &p : image) {
    double Z = 1 / (plane[0] * p[0] + plane[1] * p[1] + plane[2]);
    marks.push_back({p[0] * Z, p[1] * Z, Z});
  }
  return marks;
}

Marks moved(const Marks &marks, const vpHomogeneousMatrix &T)
{
  Marks result;
  for (const Numbers &X : marks) {
    vpPoint point(X[0], X[1], X[2]);
    point.changeFrame(T);
    result.push_back({point.get_X(), point.get_Y(), point.get_Z()});
  }
  return result;
}

vpMomentObject moment_object(const Marks &marks, vpMomentObject::vpObjectType type)
{
  std::vector<vpPoint> points;
  for (const Numbers &X : marks)
    points.push_back(seen(X));
  if (type == vpMomentObject::DENSE_POLYGON)
    points.push_back(points.front());
  vpMomentObject object(6);
  object.setType(type);
  object.fromVector(points);
  return object;
}

Numbers values(const vpMomentDatabase &database, const char *name)
{
  bool found = false;
  Numbers result = database.get(name, found).get();
  if (!found)
    throw std::runtime_error(name);
  return result;
}

// mu_ij or m_ij with i + j <= 3, in the order of the rows of "order".
const std::vector<std::pair<int, int>> ORDERS = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1},
                                                 {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}};

template <class Moment, class Feature>
void add_table(Case &given, const std::string &name, const Moment &moment, const Feature &feature)
{
  Numbers s;
  vpMatrix L;
  for (auto [i, j] : ORDERS) {
    s.push_back(moment.get(i, j));
    L.stack(feature.interaction(i, j));
  }
  given.with(name, s).with("L_" + name, L);
}

void add_feature(Case &given, const std::string &name, const Numbers &s, vpFeatureMoment &feature)
{
  given.with(name, s).with("L_" + name, feature.interaction());
}

void add_invariants(Case &given, const Numbers &s, vpFeatureMomentCInvariant &feature)
{
  vpMatrix L;
  for (unsigned int i = 0; i < 14; i++)
    L.stack(feature.interaction(1 << i));
  given.with("invariants", Numbers(s.begin(), s.begin() + 14)).with("L_invariants", L);
}

Case moment_case(vpMomentObject::vpObjectType type)
{
  Numbers plane = uniforms({-0.3, -0.3, 0.5}, {0.3, 0.3, 1.2});
  Marks marks = onto_plane(corners(), plane);
  vpHomogeneousMatrix back(0, 0, -1 / plane[2], 0, 0, 0);
  vpHomogeneousMatrix turn(0, 0, 1 / plane[2], uniform(-0.2, 0.2), uniform(-0.2, 0.2),
                           uniform(-3, 3));
  Marks goal_marks = moved(marks, turn * back);
  double goal_depth = uniform(0.5, 2.0);

  vpMomentObject object = moment_object(marks, type), goal = moment_object(goal_marks, type);
  double goal_area = vpMomentCommon::getSurface(goal), goal_alpha = vpMomentCommon::getAlpha(goal);
  vpMomentCommon moments(goal_area, vpMomentCommon::getMu3(goal), goal_alpha, goal_depth);
  moments.updateAll(object);
  vpFeatureMomentCommon features(moments);
  features.updateAll(plane[0], plane[1], plane[2]);

  Case given = Case().with("marks", marks).with("plane", plane).with("goal_marks", goal_marks);
  given.with("goal_depth", goal_depth).with("goal_area", goal_area).with("goal_alpha", goal_alpha);
  bool found;
  add_table(given, "basic", object, features.getFeatureMomentBasic());
  add_table(given, "centred",
            dynamic_cast<const vpMomentCentered &>(moments.get("vpMomentCentered", found)),
            features.getFeatureCentered());
  add_feature(given, "centroid", values(moments, "vpMomentGravityCenter"),
              features.getFeatureGravityCenter());
  if (type == vpMomentObject::DENSE_POLYGON) // ViSP has no L of an area of points
    add_feature(given, "area", values(moments, "vpMomentArea"), features.getFeatureArea());
  add_feature(given, "area_normalised", values(moments, "vpMomentAreaNormalized"),
              features.getFeatureAn());
  add_feature(given, "centroid_normalised", values(moments, "vpMomentGravityCenterNormalized"),
              features.getFeatureGravityNormalized());
  add_feature(given, "alpha", values(moments, "vpMomentAlpha"), features.getFeatureAlpha());
  add_invariants(given, values(moments, "vpMomentCInvariant"), features.getFeatureCInvariant());
  return given;
}

void moments(Document &document)
{
  std::vector<Case> polygons, points;
  for (int i = 0; i < MOMENT_CASES; i++) {
    polygons.push_back(moment_case(vpMomentObject::DENSE_POLYGON));
    points.push_back(moment_case(vpMomentObject::DISCRETE));
  }
  std::string common =
      "; plane (A, B, C) with 1/Z = A x + B y + C; basic m_ij and centred mu_ij in the order "
      "00 10 01 20 11 02 30 21 12 03; centroid (xg, yg); area_normalised an = goal_depth "
      "sqrt(goal_area / a); centroid_normalised (an xg, an yg); alpha in [-pi, pi] = "
      "atan2(2 mu11, mu20 - mu02) / 2 plus pi where the third moments say that the goal, of "
      "orientation goal_alpha, is turned by more than a quarter; invariants c1 to c10, sx, sy, px, "
      "py as ViSP numbers them";
  document.group("moments_polygon", "the region whose corners are the marks; a = m00" + common,
                 polygons);
  document.group("moments_points", "the marks as points; a = mu20 + mu02" + common, points);
}

void gains(Document &document)
{
  std::vector<Case> cases;
  for (int i = 0; i < CASES; i++) {
    double zero = uniform(1, 5), infinity = uniform(0.1, 1), slope = uniform(5, 40);
    vpAdaptiveGain gain(zero, infinity, slope);
    Numbers x = {0, 1e-3}, value;
    for (int j = 0; j < 6; j++)
      x.push_back(uniform(0, 0.5));
    for (double each : x)
      value.push_back(gain(each));
    Case given = Case().with("at_zero", zero).with("at_infinity", infinity).with("slope", slope);
    cases.push_back(given.with("x", x).with("gain", value));
  }
  document.group("adaptive_gain", "gain(x) of a norm x of the error, from gain(0), gain(infinity) "
                                  "and the slope -dgain/dx at 0", cases);
}

// Points as they are and as they should be, handed to one servo.
struct Task
{
  std::vector<vpFeaturePoint> now, goal;
  vpServo servo;

  Task(const Marks &marks, const Marks &goal_marks, vpServo::vpServoIteractionMatrixType kind,
       double gain)
    : now(marks.size()), goal(marks.size())
  {
    servo.setServo(vpServo::EYEINHAND_CAMERA);
    servo.setInteractionMatrixType(kind, vpServo::PSEUDO_INVERSE);
    servo.setLambda(gain);
    for (size_t i = 0; i < marks.size(); i++) {
      vpFeatureBuilder::create(now[i], seen(marks[i]));
      vpFeatureBuilder::create(goal[i], seen(goal_marks[i]));
      servo.addFeature(now[i], goal[i]);
    }
  }
};

Marks some_marks(int number)
{
  Marks marks;
  for (int i = 0; i < number; i++)
    marks.push_back(mark());
  return marks;
}

vpHomogeneousMatrix small_motion(double scale)
{
  Numbers t = uniforms(Numbers(6, -scale), Numbers(6, scale));
  return vpHomogeneousMatrix(t[0], t[1], t[2], t[3], t[4], t[5]);
}

void laws(Document &document)
{
  std::vector<Case> cases;
  for (int i = 0; i < CASES; i++) {
    Marks marks = some_marks(2 + i % 5), goal_marks = moved(marks, small_motion(0.15));
    double gain = uniform(0.2, 2);
    Case given = Case().with("marks", marks).with("goal_marks", goal_marks).with("gain", gain);
    Task current(marks, goal_marks, vpServo::CURRENT, gain);
    given.with("v_current", current.servo.computeControlLaw());
    given.with("e", current.servo.getError());
    Task desired(marks, goal_marks, vpServo::DESIRED, gain);
    given.with("v_desired", desired.servo.computeControlLaw());
    Task mean(marks, goal_marks, vpServo::MEAN, gain);
    given.with("v_mean", mean.servo.computeControlLaw());
    cases.push_back(given);
  }
  document.group("ibvs", "2 to 6 points eye-in-hand; V_c = -gain pinv(L) (s - s_goal) with L "
                         "current, at the goal, or the mean of both", cases);
}

void secondary_tasks(Document &document)
{
  std::vector<Case> cases;
  for (int i = 0; i < CASES; i++) {
    Marks marks = some_marks(i % 3 ? 2 : 4);
    Marks goal_marks = moved(marks, small_motion(0.05 + 0.12 * (i % 4)));
    Task task(marks, goal_marks, vpServo::CURRENT, 1.0);
    vpColVector v = task.servo.computeControlLaw();
    vpColVector g(uniforms(Numbers(6, -1), Numbers(6, 1)));
    Case given = Case().with("marks", marks).with("goal_marks", goal_marks).with("v", v);
    given.with("g", g).with("large", task.servo.secondaryTask(g, true));
    given.with("P_large", task.servo.getLargeP());
    if (marks.size() == 2) // ViSP refuses where the task leaves no freedom
      given.with("classic", task.servo.secondaryTask(g, false));
    cases.push_back(given);
  }
  document.group("secondary_task", "2 or 4 points eye-in-hand, current L, gain 1: v = -pinv(L) e; "
                                   "a motion g through the classic projection I - pinv(L) L and "
                                   "through the large one P_large, which blends it with the "
                                   "projection that keeps only the norm of e", cases);
}

void estimated_poses(Document &document)
{
  std::vector<Case> cases;
  for (int i = 0; i < CASES; i++) {
    bool planar = i % 2;
    vpHomogeneousMatrix T = random_pose({-0.2, -0.2, 1.0}, {0.2, 0.2, 1.8}, 0.7);
    double noise = i < 4 ? 0 : 2e-3;
    vpPose pose;
    Marks model, image;
    for (int j = 0; j < 4 + i % 5 + !planar; j++) {
      model.push_back(uniforms({-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}));
      if (planar)
        model.back()[2] = 0;
      vpPoint point(model.back()[0], model.back()[1], model.back()[2]);
      point.track(T);
      point.set_x(point.get_x() + noise * uniform(-1, 1));
      point.set_y(point.get_y() + noise * uniform(-1, 1));
      image.push_back({point.get_x(), point.get_y()});
      pose.addPoint(point);
    }
    vpHomogeneousMatrix guess = T * small_motion(0.05), found = guess;
    pose.setVvsEpsilon(0);
    pose.setVvsIterMax(2000);
    pose.setLambda(0.7);
    pose.computePose(vpPose::VIRTUAL_VS, found);
    Case given = Case().with("model", model).with("image", image).with("guess", guess);
    cases.push_back(given.with("T_c_o", found));
  }
  document.group("pose", "model: marks in the object, image: normalised, the first four cases free "
                         "of noise; T_c_o: what virtual visual servoing ends at from guess, a "
                         "least sum of squares in the image", cases);
}

int main(int count, char **arguments)
{
  if (count != 2) {
    std::cerr << "usage: generate_visp FILE.json\n";
    return 2;
  }
  Document document("camera axes: x right, y down, z along the optical axis; metres and radians; "
                    "sdot = L V_c, V_c = (v, omega) of the camera in its own axes at its centre; "
                    "marks, circles and spheres are given in camera axes");
  points(document);
  segments(document);
  lines(document);
  vanishing_points(document);
  ellipses(document);
  poses(document);
  moments(document);
  gains(document);
  laws(document);
  secondary_tasks(document);
  estimated_poses(document);
  std::ofstream(arguments[1]) << document.text.str() << "\n}\n";
  return 0;
}
