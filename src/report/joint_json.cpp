#include "report/joint_json.h"

#include "fit/fit_result.h"

namespace crownfit {

JsonValue JointJson(const CrownFit& fit) {
  FreeParameters free{fit.entries, fit.material, fit.capture.wavelengths_nm};
  std::vector<std::string> names;
  std::vector<Eigen::RowVectorXd> gradients;
  for (const FittedParameter& p : fit.uncertainty.parameters)
    for (size_t c = 0; c < p.stddev.size(); ++c) {
      names.push_back(p.name + (p.value.size() > 1 ? "[" + fit.capture.channel_names[c] + "]" : ""));
      const double unit = RowOf(p.quantity).scale == Scale::kLog ? p.value[c] : 1.0;
      gradients.push_back(ValueGradient(free, fit.best, p.layer, p.quantity, static_cast<int>(c)) / unit);
    }
  const size_t n = names.size();
  Eigen::MatrixXd by_entry(n, free.count());
  for (size_t i = 0; i < n; ++i) by_entry.row(static_cast<Eigen::Index>(i)) = gradients[i];
  const Eigen::MatrixXd covariance = by_entry * fit.uncertainty.covariance * by_entry.transpose();
  const Eigen::VectorXd stddev = covariance.diagonal().cwiseSqrt();
  JsonValue::Array rows;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    std::vector<double> row;
    for (Eigen::Index j = 0; j < covariance.cols(); ++j)
      row.push_back(i == j ? 1.0 : covariance(i, j) / (stddev[i] * stddev[j]));
    rows.push_back(row);
  }
  return JsonValue::Object{
      {"names", names}, {"stddev", std::vector<double>(stddev.begin(), stddev.end())}, {"correlation", rows}};
}

}  // namespace crownfit
