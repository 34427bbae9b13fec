#!/usr/bin/env python3
"""Open3D's multiway registration of a folder of scans, after its tutorial and its reconstruction system: all pairs by FPFH and RANSAC, ICP point
to plane, a pose graph with its defaults. Run by scripts/align.py.

    python3 scripts/align_open3d.py FOLDER POSES.json
"""

import json
import sys
from pathlib import Path

import numpy as np
import open3d as o3d

reg = o3d.pipelines.registration


def read(path):
    if path.suffix == ".ply":
        return o3d.io.read_point_cloud(str(path))
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.loadtxt(path, usecols=(0, 1, 2))))


def main():
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    files = sorted(p for p in folder.iterdir() if p.suffix in (".ply", ".xyz"))
    o3d.utility.random.seed(1)
    clouds = [read(p) for p in files]
    size = np.median([np.linalg.norm(c.get_max_bound() - c.get_min_bound()) for c in clouds])
    voxel = size / 60  # the tutorial's 0.02 m on a living room of a few metres, its reconstruction system's 0.05 m
    down, features = [], []
    for cloud in clouds:
        thin = cloud.voxel_down_sample(voxel)
        thin.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * voxel, max_nn=30))
        down.append(thin)
        search = o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel, max_nn=100)
        features.append(reg.compute_fpfh_feature(thin, search))
    graph = reg.PoseGraph()
    odometry = np.eye(4)
    graph.nodes.append(reg.PoseGraphNode(odometry))
    far = 1.5 * voxel
    for s in range(len(down)):
        for t in range(s + 1, len(down)):
            checkers = [reg.CorrespondenceCheckerBasedOnEdgeLength(0.9), reg.CorrespondenceCheckerBasedOnDistance(far)]
            rough = reg.registration_ransac_based_on_feature_matching(
                down[s], down[t], features[s], features[t], False, far,
                reg.TransformationEstimationPointToPoint(False), 4, checkers,
                reg.RANSACConvergenceCriteria(1000000, 0.999),
            )  # fmt: skip
            plane = reg.TransformationEstimationPointToPlane()
            fine = reg.registration_icp(down[s], down[t], far, rough.transformation, plane)
            information = reg.get_information_matrix_from_point_clouds(down[s], down[t], far, fine.transformation)
            if t == s + 1:
                odometry = fine.transformation @ odometry
                graph.nodes.append(reg.PoseGraphNode(np.linalg.inv(odometry)))
            # As in the reconstruction system: a loop that matches less than 0.3 of the smaller cloud is left out.
            elif information[5, 5] / min(len(down[s].points), len(down[t].points)) < 0.3:
                continue
            graph.edges.append(reg.PoseGraphEdge(s, t, fine.transformation, information, uncertain=t != s + 1))
    option = reg.GlobalOptimizationOption(max_correspondence_distance=far, edge_prune_threshold=0.25, reference_node=0)
    reg.global_optimization(
        graph, reg.GlobalOptimizationLevenbergMarquardt(), reg.GlobalOptimizationConvergenceCriteria(), option
    )
    poses = {p.name: node.pose.tolist() for p, node in zip(files, graph.nodes)}
    out.write_text(json.dumps(poses))


if __name__ == "__main__":
    main()
