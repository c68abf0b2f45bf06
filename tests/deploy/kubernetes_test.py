"""Compares the manifests of deploy/kubernetes with each other, the programs and the Containerfile.

  kubernetes_test.py TREE FOLDER-OF-THE-PROGRAMS
"""
import pathlib
import re
import subprocess
import sys
import unittest

import counting

try:
    import yaml
except ImportError:
    print("there is no python3-yaml here")
    sys.exit(77)

TREE = pathlib.Path(sys.argv.pop(1))
PROGRAMS = pathlib.Path(sys.argv.pop(1))
FOLDER = TREE / "deploy/kubernetes"


def objects():
    """Returns all objects that the kustomization lists, by kind and name."""
    files = yaml.safe_load((FOLDER / "kustomization.yaml").read_text())["resources"]
    found = [o for f in files for o in yaml.safe_load_all((FOLDER / f).read_text())]
    return {(o["kind"], o["metadata"]["name"]): o for o in found}


OBJECTS = objects()
SERVER = OBJECTS["StatefulSet", "oblique-server"]["spec"]
WORKER = OBJECTS["Deployment", "oblique-worker"]["spec"]


def pod(workload):
    return workload["template"]["spec"]


def container(workload):
    return pod(workload)["containers"][0]


def variables(workload):
    return {v["name"]: v.get("value") for v in container(workload)["env"]}


class Manifests(unittest.TestCase):
    def test_each_file_of_the_folder_is_used_or_explained(self):
        used = yaml.safe_load((FOLDER / "kustomization.yaml").read_text())["resources"]
        readme = (FOLDER / "README.md").read_text()
        for file in FOLDER.glob("*.yaml"):
            self.assertIn(file.name, readme)
        self.assertEqual(set(used) | {"kustomization.yaml", "prometheus-adapter.yaml"},
                         {f.name for f in FOLDER.glob("*.yaml")})

    def test_programs_take_the_variables_that_pods_have(self):
        for workload, program in (SERVER, "oblique-server"), (WORKER, "oblique-worker"):
            # Invented values for variables that the cluster sets.
            values = {n: v or {"OBLIQUE_WORKER_THREADS": "4"}.get(n, "pod-1")
                      for n, v in variables(workload).items()}
            printed = subprocess.run([PROGRAMS / program, "--print-config"], env=values, text=True,
                                     capture_output=True)
            self.assertEqual(printed.returncode, 0, printed.stderr)
            for name, value in values.items():
                key = re.sub("^OBLIQUE_(SERVER_|WORKER_)?", "", name).lower()
                self.assertRegex(printed.stdout, rf'(?m)^({key}|{key.split("_", 1)[-1]}) = \[?"?{re.escape(str(value))}"?\]?$')

    def test_selectors_find_the_pods(self):
        labels = {"oblique-server": SERVER["template"]["metadata"]["labels"],
                  "oblique-worker": WORKER["template"]["metadata"]["labels"]}
        self.assertEqual(SERVER["selector"]["matchLabels"], labels["oblique-server"])
        self.assertEqual(WORKER["selector"]["matchLabels"], labels["oblique-worker"])
        self.assertEqual(OBJECTS["Service", "oblique-server"]["spec"]["selector"], labels["oblique-server"])
        for name in labels:
            policy = OBJECTS["NetworkPolicy", name]["spec"]
            self.assertEqual(policy["podSelector"]["matchLabels"], labels[name])
            self.assertEqual(policy["policyTypes"], ["Ingress", "Egress"])
        budget = OBJECTS["PodDisruptionBudget", "oblique-worker"]["spec"]
        self.assertEqual(budget["selector"]["matchLabels"], labels["oblique-worker"])

    def test_ports_are_those_of_the_program_and_have_the_same_names_everywhere(self):
        ports = {p["name"]: p["containerPort"] for p in container(SERVER)["ports"]}
        printed = subprocess.run([PROGRAMS / "oblique-server", "--no-config", "--print-config"], text=True,
                                 capture_output=True).stdout
        for name, key in ("clients", "client_port"), ("workers", "worker_port"):
            self.assertIn(f"\n{key} = {ports[name]}\n", printed)
        self.assertTrue(variables(SERVER)["OBLIQUE_SERVER_HTTP"].endswith(f":{ports['http']}"))
        service = OBJECTS["Service", "oblique-server"]["spec"]["ports"]
        self.assertEqual({p["targetPort"]: p["port"] for p in service}, ports)
        for probe in "startupProbe", "livenessProbe", "readinessProbe":
            self.assertEqual(container(SERVER)[probe]["httpGet"]["port"], "http")
        allowed = [p["port"] for rule in OBJECTS["NetworkPolicy", "oblique-server"]["spec"]["ingress"]
                   for p in rule["ports"]]
        self.assertEqual(sorted(allowed), sorted(ports))
        way_out = OBJECTS["NetworkPolicy", "oblique-worker"]["spec"]["egress"][0]["ports"]
        self.assertEqual([p["port"] for p in way_out], [ports["workers"]])
        self.assertEqual(variables(WORKER)["OBLIQUE_WORKER_SERVER"],
                         f"tcp://{OBJECTS['Service', 'oblique-server']['metadata']['name']}:{ports['workers']}")
        annotations = SERVER["template"]["metadata"]["annotations"]
        self.assertEqual(annotations["prometheus.io/port"], str(ports["http"]))

    def test_keys_are_mounted_where_programs_look_from_secrets_that_the_readme_makes(self):
        readme = (FOLDER / "README.md").read_text()
        for workload, variable in (SERVER, "OBLIQUE_SERVER_KEYS"), (WORKER, "OBLIQUE_WORKER_KEYS"):
            file = pathlib.PurePosixPath(variables(workload)[variable])
            mounts = {m["mountPath"]: m for m in container(workload)["volumeMounts"]}
            mount = mounts[str(file.parent)]
            self.assertTrue(mount["readOnly"])
            secret = next(v for v in pod(workload)["volumes"] if v["name"] == mount["name"])["secret"]
            # The group may read the key. The programs refuse a key that all users may read.
            self.assertEqual(secret["defaultMode"], 0o440)
            self.assertRegex(readme, f"create secret generic {secret['secretName']} .*--from-file=keys/{file.name}")

    def test_all_mounts_have_volumes(self):
        for workload in SERVER, WORKER:
            claims = [c["metadata"]["name"] for c in workload.get("volumeClaimTemplates", [])]
            volumes = [v["name"] for v in pod(workload).get("volumes", [])]
            mounted = [m["name"] for m in container(workload)["volumeMounts"]]
            self.assertEqual(sorted(mounted), sorted(claims + volumes))

    def test_pods_end_later_than_what_they_wait_for(self):
        self.assertGreater(pod(SERVER)["terminationGracePeriodSeconds"],
                           int(variables(SERVER)["OBLIQUE_SERVER_DRAIN"]))

    def test_pods_keep_to_the_restricted_standard(self):
        namespace = OBJECTS["Namespace", "oblique"]["metadata"]["labels"]
        self.assertEqual(namespace["pod-security.kubernetes.io/enforce"], "restricted")
        user = re.search(r"^USER (\d+):(\d+)$", (TREE / "deploy/container/Containerfile").read_text(), re.M)
        for workload in SERVER, WORKER:
            of_pod, of_container = pod(workload)["securityContext"], container(workload)["securityContext"]
            self.assertTrue(of_pod["runAsNonRoot"])
            self.assertEqual((str(of_pod["runAsUser"]), str(of_pod["runAsGroup"])), user.groups())
            self.assertEqual(of_pod["fsGroup"], of_pod["runAsGroup"])
            self.assertEqual(of_pod["seccompProfile"]["type"], "RuntimeDefault")
            self.assertFalse(of_container["allowPrivilegeEscalation"])
            self.assertTrue(of_container["readOnlyRootFilesystem"])
            self.assertEqual(of_container["capabilities"], {"drop": ["ALL"]})

    def test_the_autoscaler_asks_for_a_metric_that_the_server_has_and_the_adapter_brings(self):
        scaler = OBJECTS["HorizontalPodAutoscaler", "oblique-worker"]["spec"]
        self.assertIn(("Deployment", scaler["scaleTargetRef"]["name"]), OBJECTS)
        metric = scaler["metrics"][0]["external"]
        rule = yaml.safe_load((FOLDER / "prometheus-adapter.yaml").read_text())["rules"]["external"][0]
        self.assertEqual(rule["name"]["as"], metric["metric"]["name"])
        self.assertTrue(rule["seriesQuery"].startswith(metric["metric"]["name"] + "{"))
        self.assertIn(f"| `{metric['metric']['name']}` | gauge |", (TREE / "server/web/README.md").read_text())
        self.assertEqual(metric["target"]["averageValue"], container(WORKER)["resources"]["limits"]["cpu"])

    def test_images_are_those_that_the_container_file_makes(self):
        stages = re.findall(r" AS (\w+)$", (TREE / "deploy/container/Containerfile").read_text(), re.M)
        images = yaml.safe_load((FOLDER / "kustomization.yaml").read_text())["images"]
        version = re.search(r"project\(oblique VERSION ([\d.]+)", (TREE / "CMakeLists.txt").read_text())[1]
        for workload in SERVER, WORKER:
            name = container(workload)["image"]
            self.assertIn(name.removeprefix("oblique-"), stages)
            self.assertEqual([i["newTag"] for i in images if i["name"] == name], [version])


if __name__ == "__main__":
    counting.main()
